/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * A sensor whose reading is a polynomial of the position:
 *
 *     reading = c + h (s + quadratic s^2 + cubic s^3),     s = (position - c) / h
 */
#include "catalogue.h"
#include <math.h>

enum { QUADRATIC, CUBIC, CENTER, HALF_RANGE };

static const parameter_info_t parameters[] = {{.name = "quadratic",
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
                                              {.name = "center_um",
                                               .unit = "um",
                                               .low = -1e9,
                                               .high = 1e9,
                                               .chosen = true,
                                               .center_of = "displacement_range_um",
                                               .text = "middle of the range, where the reading is right"},
                                              {.name = "half_range_um",
                                               .unit = "um",
                                               .low = 1e-9,
                                               .high = 1e9,
                                               .chosen = true,
                                               .half_of = "displacement_range_um",
                                               .text = "half of the range that the two numbers refer to"}};

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

static void open(void *memory, const parameter_t *parameter, const stage_setup_t *setup) {
    (void)setup;
    *(state_t *)memory = (state_t){.quadratic = parameter[QUADRATIC].value[0],
                                   .cubic = parameter[CUBIC].value[0],
                                   .center_um = parameter[CENTER].value[0],
                                   .half_range_um = parameter[HALF_RANGE].value[0]};
}

static void step(void *memory, signal_t *signal) {
    const state_t *state = memory;
    const double s = (signal->value - state->center_um) / state->half_range_um;
    signal->value += state->half_range_um * s * s * (state->quadratic + state->cubic * s);
}

static bool probe(const probe_setting_t *setting, size_t index, double *value) {
    value[QUADRATIC] = index == 0 ? 0.005 : 0.0;
    value[CUBIC] = index == 1 ? 0.005 : 0.0;
    value[CENTER] = 0.5 * (setting->displacement_high_um + setting->displacement_low_um);
    value[HALF_RANGE] = 0.5 * (setting->displacement_high_um - setting->displacement_low_um);
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
    .accuracy = 0.02};

const block_t block_static_nonlinearity = {
    .name = "static_nonlinearity",
    .place = PLACE_SENSOR,
    .adds = true,
    .text = "curved characteristic of the position sensor",
    .parameter = parameters,
    .parameters = 4,
    .check = check,
    .state_bytes = sizeof(state_t),
    .open = open,
    .settle = step,
    .step = step,
    .uncorrected = "it is the sensor's: the position follows the reference, the reading keeps its curve",
    .probe = &looked_for};
