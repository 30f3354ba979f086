/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * A curved characteristic in front of the play operators: they see
 *
 *     g(u) = c + h (s + asymmetry (s^2 - 1)),     s = (u - c) / h,
 *
 * which leaves the ends of the range where they are and makes the rising branch no mirror image of the falling one.
 * Beyond the ends it goes on straight, so that it rises everywhere.
 */
#include "catalogue.h"
#include <math.h>

enum { ASYMMETRY, CENTER, HALF_RANGE };

static const parameter_info_t parameters[] = {
    {.name = "asymmetry",
     .unit = "1",
     .low = -0.45,
     .high = 0.45,
     .text = "drive that the operators miss in the middle of the range, of half the range"},
    {.name = "center_v",
     .unit = "V",
     .low = -1e9,
     .high = 1e9,
     .chosen = true,
     .center_of = "drive_range_v",
     .text = "middle of the drive range"},
    {.name = "half_range_v",
     .unit = "V",
     .low = 1e-9,
     .high = 1e9,
     .chosen = true,
     .half_of = "drive_range_v",
     .text = "half of the drive range"}};

typedef struct {
    double asymmetry, center_v, half_range_v;
} state_t;

static void open(void *memory, const parameter_t *parameter, const stage_setup_t *setup) {
    (void)setup;
    *(state_t *)memory =
        (state_t){parameter[ASYMMETRY].value[0], parameter[CENTER].value[0], parameter[HALF_RANGE].value[0]};
}

static void step(void *memory, signal_t *signal) {
    const state_t *state = memory;
    const double s = (signal->value - state->center_v) / state->half_range_v;
    const double curve = fabs(s) < 1.0 ? s * s - 1.0 : 2.0 * (fabs(s) - 1.0);
    signal->value += state->asymmetry * state->half_range_v * curve;
}

const block_t block_asymmetric_hysteresis = {.name = "asymmetric_hysteresis",
                                             .place = PLACE_HYSTERESIS,
                                             .modifies_hysteresis = true,
                                             .text = "operators that see a curved drive: branches that do not mirror",
                                             .parameter = parameters,
                                             .parameters = 3,
                                             .state_bytes = sizeof(state_t),
                                             .open = open,
                                             .settle = step,
                                             .step = step};
