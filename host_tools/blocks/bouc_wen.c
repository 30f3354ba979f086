/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Bouc-Wen hysteresis, followed by the recursion of paper 001. docs/MODELS.md, section 8.
 *
 *     x = offset + d u + s h,      dh/du = 1 - (gamma + beta sgn(u' h)) |h|^n
 */
#include "elements/bouc_wen.h"
#include "chain/catalogue.h"
#include "chain/parameter_rows.h"
#include "compile/compile_bouc_wen.h"
#include "elements/recursion.h"
#include <math.h>

enum { OFFSET, DIRECT, HYSTERETIC, BETA, GAMMA, EXPONENT, RECURSION };

static const parameter_info_t parameters[] = {
    {.name = "offset_um", .unit = "um", .low = -1e9, .high = 1e9, .text = "added to every sample's recursion"},
    {.name = "direct_um",
     .unit = "um",
     .low = -1e9,
     .high = 1e9,
     .text = "d: of the drive itself, as a fraction of its half range"},
    {.name = "hysteretic_um", .unit = "um", .low = -1e9, .high = 1e9, .text = "s: of the hysteretic part h"},
    {.name = "beta", .unit = "1", .low = 0.0, .high = 1e3, .text = "how h saturates and returns"},
    {.name = "gamma", .unit = "1", .low = -1e3, .high = 1e3, .text = "how h saturates; magnitude at most beta"},
    {.name = "exponent",
     .unit = "1",
     .low = 1.0,
     .high = 20.0,
     .optional = true,
     .default_value = 1.0,
     .text = "n: how sharply h saturates"},
    RECURSION_PARAMETER_TABLE,
    PARAMETER_MEMORY("past_v", "V",
                     "drives before the first sample, one after the other, from the middle on; absent: h was 0 there")};

enum { PAST = RECURSION + RECURSION_PARAMETERS, PARAMETERS };

typedef struct {
    double offset_um, direct_um, hysteretic_um;
    bouc_wen_t hysteresis;
    recursion_t recursion;
    size_t past;
    double past_v[];
} state_t;

static bool check(const parameter_t *parameter, failure_t *failure) {
    const double beta = parameter[BETA].value[0], gamma = parameter[GAMMA].value[0];
    if (!(fabs(gamma) <= beta)) {
        return fail(failure, "gamma = %g is larger than beta = %g: loops would run clockwise", gamma, beta);
    }
    return recursion_check(parameter + RECURSION, failure);
}

static bool has_recursion(const parameter_t *parameter) {
    return recursion_is_used(parameter + RECURSION);
}

static size_t further_bytes(const parameter_t *parameter, const stage_setup_t *setup) {
    (void)setup;
    return parameter[PAST].count * sizeof(double);
}

static void open(void *memory, const parameter_t *parameter, const stage_setup_t *setup) {
    state_t *state = memory;
    state->offset_um = parameter[OFFSET].value[0];
    state->direct_um = parameter[DIRECT].value[0];
    state->hysteretic_um = parameter[HYSTERETIC].value[0];
    bouc_wen_open(&state->hysteresis, parameter[BETA].value[0], parameter[GAMMA].value[0],
                  parameter[EXPONENT].value[0]);
    recursion_open(&state->recursion, parameter + RECURSION, setup);
    state->past = parameter[PAST].count;
    for (size_t i = 0; i < state->past; i++) {
        state->past_v[i] = parameter[PAST].value[i];
    }
}

static double respond(const state_t *state, double u, double h) {
    return state->offset_um + state->direct_um * u + state->hysteretic_um * h;
}

static void settle(void *memory, signal_t *signal) {
    state_t *state = memory;
    const double u = recursion_input(&state->recursion, signal->value);
    (void)bouc_wen_settle(&state->hysteresis, 0.0);
    for (size_t i = 0; i < state->past; i++) {
        (void)bouc_wen_step(&state->hysteresis, recursion_input(&state->recursion, state->past_v[i]));
    }
    const double h = bouc_wen_step(&state->hysteresis, u);
    signal->value = recursion_settle(&state->recursion, respond(state, u, h), u);
}

static void step(void *memory, signal_t *signal) {
    state_t *state = memory;
    const double u = recursion_input(&state->recursion, signal->value);
    signal->value = recursion_step(&state->recursion, respond(state, u, bouc_wen_step(&state->hysteresis, u)), u);
}

static void pass(void *memory, double drive_v) {
    state_t *state = memory;
    (void)bouc_wen_step(&state->hysteresis, recursion_input(&state->recursion, drive_v));
}

/* Compiles the curve. The amplifier supports a recursion after it only for block modified_play. */
static bool compile(compile_job_t *job, const parameter_t *parameter) {
    bouc_wen_t hysteresis;
    if (recursion_is_used(parameter + RECURSION)) {
        return fail(job->failure, "the amplifier runs it without feedback, bilinear gain and harmonics: for those, fit "
                                  "family modified_play");
    }
    bouc_wen_open(&hysteresis, parameter[BETA].value[0], parameter[GAMMA].value[0], parameter[EXPONENT].value[0]);
    return compile_bouc_wen(job, &hysteresis, parameter[OFFSET].value[0], parameter[DIRECT].value[0],
                            parameter[HYSTERETIC].value[0], parameter[RECURSION + RECURSION_CENTER].value[0],
                            parameter[RECURSION + RECURSION_HALF_RANGE].value[0]);
}

const block_t block_bouc_wen = {.name = "bouc_wen",
                                .place = PLACE_HYSTERESIS,
                                .order = 100,
                                .one_sample_rate = has_recursion,
                                .text = "Bouc-Wen hysteresis, and a recursion behind it if requested",
                                .parameter = parameters,
                                .parameters = PARAMETERS,
                                .check = check,
                                .state_bytes = sizeof(state_t),
                                .further_bytes = further_bytes,
                                .open = open,
                                .settle = settle,
                                .step = step,
                                .pass = pass,
                                .compile = compile};
