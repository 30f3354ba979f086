/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * A nonlinear characteristic before the play operators, whose input is
 *
 *     g(u) = c + h (s + asymmetry (s^2 - 1)),     s = (u - c) / h,
 *
 * which keeps the ends of the range and makes the rising and the falling branch asymmetric. Beyond the ends it
 * continues linearly, so that it rises everywhere.
 */
#include "chain/catalogue.h"
#include "chain/parameter_rows.h"
#include "compile/compile_job.h"
#include <math.h>

enum { ASYMMETRY, CENTER, HALF_RANGE };

static const parameter_info_t parameters[] = {
    {.name = "asymmetry",
     .proportional = true,
     .unit = "1",
     .low = -0.45,
     .high = 0.45,
     .text = "drive that the operators miss in the middle of the range, of half the range"},
    PARAMETER_CENTER("center_v", "V", "drive_range_v", "middle of the drive range"),
    PARAMETER_HALF_RANGE("half_range_v", "V", "drive_range_v", "half of the drive range")};

typedef struct {
    double asymmetry, center_v, half_range_v;
} state_t;

static state_t state_of(const parameter_t *parameter) {
    return (state_t){parameter[ASYMMETRY].value[0], parameter[CENTER].value[0], parameter[HALF_RANGE].value[0]};
}

static void open(void *memory, const parameter_t *parameter, const stage_setup_t *setup) {
    (void)setup;
    *(state_t *)memory = state_of(parameter);
}

static double curve(const void *memory, double drive_v) {
    const state_t *state = memory;
    const double s = (drive_v - state->center_v) / state->half_range_v;
    const double bend = fabs(s) < 1.0 ? s * s - 1.0 : 2.0 * (fabs(s) - 1.0);
    return drive_v + state->asymmetry * state->half_range_v * bend;
}

static void step(void *memory, signal_t *signal) {
    signal->value = curve(memory, signal->value);
    signal->turn_v = curve(memory, signal->turn_v);
}

/* The largest error is that of the chord of a parabola. */
static bool compile(compile_job_t *job, const parameter_t *parameter) {
    const state_t state = state_of(parameter);
    const double chord = job->drive_half_v / HYST_CURVE_INTERVALS / state.half_range_v;
    if (!compile_drive_curve(job, curve, &state)) {
        return false;
    }
    compile_note(job, "%s: undone in front of the operators, to %.2g V", job->block,
                 fabs(state.asymmetry) * chord * chord * state.half_range_v);
    return true;
}

static bool probe(const probe_setting_t *setting, size_t index, double *value) {
    value[ASYMMETRY] = 0.01;
    probe_range(setting->drive_low_v, setting->drive_high_v, &value[CENTER], &value[HALF_RANGE]);
    return index == 0;
}

static const probe_t looked_for = {
    .group = "shape",
    .explanation = "Rising and falling branches are no mirror images of each other, independent of frequency.",
    .excitation = "a second sensor, or the same loops with the sensor shifted: a curved sensor stays, an asymmetric "
                  "hysteresis moves",
    .parts = PROBE_LADDER | PROBE_LOOPS,
    .shape = true,
    .probe = probe,
    .searched = 1U << ASYMMETRY,
    .accuracy = {0.02}};

const block_t block_asymmetric_hysteresis = {.name = "asymmetric_hysteresis",
                                             .place = PLACE_HYSTERESIS,
                                             .order = 10,
                                             .modifies_hysteresis = true,
                                             .text = "operators that see a curved drive: branches that do not mirror",
                                             .parameter = parameters,
                                             .parameters = 3,
                                             .state_bytes = sizeof(state_t),
                                             .open = open,
                                             .settle = step,
                                             .step = step,
                                             .compile = compile,
                                             .probe = &looked_for};
