/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * A sensor whose reading is a polynomial of the position:
 *
 *     reading = c + h (s + quadratic s^2 + cubic s^3),     s = (position - c) / h
 *
 * Beyond the ends of the range, |s| = 1, it continues linearly, so that it rises everywhere.
 */
#include "chain/catalogue.h"
#include "chain/parameter_rows.h"
#include "compile/compile_job.h"
#include <math.h>

enum { QUADRATIC, CUBIC, CENTER, HALF_RANGE };

static const parameter_info_t parameters[] = {
    {.name = "quadratic",
     .proportional = true,
     .unit = "1",
     .low = -1.0,
     .high = 1.0,
     .text = "error at both ends, of half the range"},
    {.name = "cubic",
     .proportional = true,
     .unit = "1",
     .low = -1.0,
     .high = 1.0,
     .text = "error at the upper end, of half the range"},
    PARAMETER_CENTER("center_um", "um", "displacement_range_um", "middle of the range, where the reading is right"),
    PARAMETER_HALF_RANGE("half_range_um", "um", "displacement_range_um",
                         "half of the range that the two numbers refer to")};

typedef struct {
    double quadratic, cubic, center_um, half_range_um;
} state_t;

/* The slope 1 + 2 q s + 3 k s^2 is positive for all s in [-1, 1]. */
static bool check(const parameter_t *parameter, failure_t *failure) {
    const double q = parameter[QUADRATIC].value[0], k = parameter[CUBIC].value[0];
    double least = 1.0 - 2.0 * fabs(q) + 3.0 * k;
    if (fabs(q) < 3.0 * k) { /* a minimum inside, at s = -q / 3k */
        least = 1.0 - q * q / (3.0 * k);
    }
    return least > 0.0 || fail(failure, "with quadratic = %g and cubic = %g the reading falls within the range", q, k);
}

static state_t state_of(const parameter_t *parameter) {
    return (state_t){.quadratic = parameter[QUADRATIC].value[0],
                     .cubic = parameter[CUBIC].value[0],
                     .center_um = parameter[CENTER].value[0],
                     .half_range_um = parameter[HALF_RANGE].value[0]};
}

static void open(void *memory, const parameter_t *parameter, const stage_setup_t *setup) {
    (void)setup;
    *(state_t *)memory = state_of(parameter);
}

/* Of the reading by the position, within the range. */
static double slope_at(const state_t *state, double s) {
    return 1.0 + s * (2.0 * state->quadratic + 3.0 * state->cubic * s);
}

/* Error of the sensor at s, as a fraction of half the range. */
static double error_at(const state_t *state, double s) {
    const double inside = fmax(-1.0, fmin(s, 1.0));
    return inside * inside * (state->quadratic + state->cubic * inside) +
           (s - inside) * (slope_at(state, inside) - 1.0);
}

static double reading_of(const state_t *state, double position_um) {
    return position_um +
           state->half_range_um * error_at(state, (position_um - state->center_um) / state->half_range_um);
}

static void step(void *memory, signal_t *signal) {
    signal->value = reading_of(memory, signal->value);
}

/* Halves the range, then goes along the slope: that is the rest of the way where the reading is beyond the range. */
static double position_of(const void *memory, double reading_um) {
    enum { HALVINGS = 52 };
    const state_t *state = memory;
    const double reading = (reading_um - state->center_um) / state->half_range_um;
    double low = -1.0, high = 1.0;
    for (int i = 0; i < HALVINGS; i++) {
        const double middle = 0.5 * (low + high);
        *(middle + error_at(state, middle) < reading ? &low : &high) = middle;
    }
    return state->center_um +
           state->half_range_um * (low + (reading - low - error_at(state, low)) / slope_at(state, low));
}

/* The amplifier converts readings to positions by linear interpolation between 33 nodes. The error is evaluated at
 * eight points of each line. */
static double worst_error_um(const compile_job_t *job, const state_t *state, double center_um, double half_um) {
    enum { PLACES = 8 * HYST_CURVE_INTERVALS };
    double worst = 0.0;
    for (int i = 0; i < PLACES; i++) {
        const hyst_q31_t reading = hyst_saturate(HYST_Q31_MIN + ((int64_t)1 << 32) / PLACES * i);
        const double position = 0x1p-31 * hyst_curve_apply(job->parameters->reference_curve, reading);
        worst = fmax(worst, fabs(reading_of(state, job->elastic_center_um + job->elastic_half_um * position) -
                                 (center_um + half_um * 0x1p-31 * reading)));
    }
    return worst;
}

static bool compile(compile_job_t *job, const parameter_t *parameter) {
    const state_t state = state_of(parameter);
    const double center_um = job->elastic_center_um, half_um = job->elastic_half_um;
    if (job->options->follow_position) {
        compile_uncorrected(job, "the position follows the reference, the reading keeps the sensor's curve");
        return true;
    }
    if (!compile_reference_curve(job, position_of, &state)) {
        return false;
    }
    compile_note(job, "%s: the reading follows the reference, to %.2g um, and not the position (--follow)", job->block,
                 worst_error_um(job, &state, center_um, half_um));
    return true;
}

static bool probe(const probe_setting_t *setting, size_t index, double *value) {
    value[QUADRATIC] = index == 0 ? 0.005 : 0.0;
    value[CUBIC] = index == 1 ? 0.005 : 0.0;
    probe_range(setting->displacement_low_um, setting->displacement_high_um, &value[CENTER], &value[HALF_RANGE]);
    return index < 2;
}

static const probe_t looked_for = {
    .group = "shape",
    .explanation = "The reading is a curved function of the position, the same after any history and at any frequency.",
    .excitation = "a second sensor, or the same loops with the sensor shifted",
    .parts = PROBE_LADDER | PROBE_LOOPS,
    .shape = true,
    .probe = probe,
    .searched = 1U << QUADRATIC | 1U << CUBIC,
    .accuracy = {0.05}};

const block_t block_static_nonlinearity = {.name = "static_nonlinearity",
                                           .place = PLACE_SENSOR,
                                           .order = 20,
                                           .adds = true,
                                           .text = "curved characteristic of the position sensor",
                                           .parameter = parameters,
                                           .parameters = 4,
                                           .check = check,
                                           .state_bytes = sizeof(state_t),
                                           .open = open,
                                           .settle = step,
                                           .step = step,
                                           .compile = compile,
                                           .probe = &looked_for};
