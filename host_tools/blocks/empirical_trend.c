/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * No physical effect: a smooth curve of time through eight values, for a reading that wanders and no effect of the
 * catalogue says why. It begins at 0, and stays where it is when its duration is over.
 */
#include "chain/catalogue.h"
#include "elements/knot_curve.h"
#include <math.h>

enum { DURATION = KNOT_CURVE_INTERVALS, PARAMETERS };

#define KNOT(number)                                                                                                   \
    {                                                                                                                  \
        .name = "knot_" #number "_um", .proportional = true, .unit = "um", .low = -1e6, .high = 1e6,                   \
        .text = "change of the reading since the beginning, at " #number "/8 of the duration"                          \
    }

static const parameter_info_t parameters[PARAMETERS] = {
    KNOT(1),
    KNOT(2),
    KNOT(3),
    KNOT(4),
    KNOT(5),
    KNOT(6),
    KNOT(7),
    KNOT(8),
    {.name = "duration_s", .unit = "s", .low = 1e-3, .high = 1e9, .chosen = true, .text = "until the last of them"}};

typedef struct {
    knot_curve_t curve;
    double per_sample; /* intervals */
    uint64_t samples;  /* since the recording began */
} state_t;

static void open(void *memory, const parameter_t *parameter, const stage_setup_t *setup) {
    state_t *state = memory;
    double value[KNOT_CURVE_KNOTS] = {0.0};
    for (size_t i = 0; i < KNOT_CURVE_INTERVALS; i++) {
        value[i + 1] = parameter[i].value[0];
    }
    knot_curve_make(value, &state->curve);
    state->per_sample = KNOT_CURVE_INTERVALS / (parameter[DURATION].value[0] * setup->sample_rate_hz);
}

static void settle(void *memory, signal_t *signal) {
    (void)signal;
    ((state_t *)memory)->samples = 0;
}

static void step(void *memory, signal_t *signal) {
    state_t *state = memory;
    signal->value +=
        knot_curve_at(&state->curve, fmin((double)state->samples++ * state->per_sample, KNOT_CURVE_INTERVALS));
}

/* It is linear in its values, so that any beginning will do. */
static bool probe(const probe_setting_t *setting, size_t index, double *value) {
    value[DURATION] = setting->longest_s;
    return index == 0;
}

static const probe_t fitted = {
    .explanation = "No known effect fits. This smooth curve of time describes it, without a cause.",
    .excitation = "the same drive again later, with the temperature measured and a rest before and after",
    .probe = probe,
    .searched = (1U << KNOT_CURVE_INTERVALS) - 1U};

const block_t block_empirical_trend = {
    .name = "empirical_trend",
    .place = PLACE_SENSOR,
    .order = 110,
    .adds = true,
    .text = "no physical effect: a smooth curve of time on the reading",
    .parameter = parameters,
    .parameters = PARAMETERS,
    .state_bytes = sizeof(state_t),
    .open = open,
    .settle = settle,
    .step = step,
    .uncorrected = "it is a curve of the time since one recording began, and the amplifier does not know when it will "
                   "be so again",
    .empirical = &fitted};
