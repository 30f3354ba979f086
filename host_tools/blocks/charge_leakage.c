/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Leakage of charge, or a capacitively coupled drive: the position returns to rest exponentially. */
#include "chain/catalogue.h"
#include "chain/parameter_rows.h"
#include "elements/first_order_lag.h"
#include <gsl/gsl_math.h>

enum { TIME_CONSTANT, REST, INITIAL };

static const parameter_info_t parameters[] = {
    {.name = "time_constant_s", .unit = "s", .low = 1e-6, .high = 1e9, .text = "in which all but 1/e has leaked away"},
    {.name = "rest_um",
     .unit = "um",
     .low = -1e9,
     .high = 1e9,
     .optional = true,
     .text = "position when nothing is left of the charge"},
    PARAMETER_INITIAL("initial_um", "um",
                      "what had leaked away when the recording began (default: all of its first sample)")};

typedef struct {
    first_order_stage_t leaked;
    double rest_um, initial_um;
    bool has_initial;
} state_t;

static void open(void *memory, const parameter_t *parameter, const stage_setup_t *setup) {
    state_t *state = memory;
    first_order_lag_set(&state->leaked.lag, 1.0 / (2.0 * M_PI * parameter[TIME_CONSTANT].value[0]),
                        setup->sample_rate_hz, setup->steps);
    state->rest_um = parameter[REST].value[0];
    state->has_initial = parameter[INITIAL].count > 0;
    state->initial_um = state->has_initial ? parameter[INITIAL].value[0] : 0.0;
}

static void settle(void *memory, signal_t *signal) {
    state_t *state = memory;
    const double held = signal->value;
    first_order_stage_settle(&state->leaked, signal);
    if (state->has_initial) {
        state->leaked.lag.output = state->initial_um;
    }
    signal->value = state->rest_um + held - state->leaked.lag.output;
}

static void step(void *memory, signal_t *signal) {
    state_t *state = memory;
    const double held = signal->value;
    first_order_stage_step(&state->leaked, signal);
    signal->value = state->rest_um + held - signal->value;
}

static bool probe(const probe_setting_t *setting, size_t index, double *value) {
    value[1] = 0.0;
    return probe_between(10.0 * setting->longest_s, 0.01 * setting->longest_s, 5, index, value);
}

static const probe_t looked_for = {
    .group = "slow",
    .explanation =
        "The charge leaks away: a held position returns towards rest, against the direction of the last step.",
    .excitation = "long holds at several levels: leakage goes with the level, drift does not",
    .parts = PROBE_SILENCE | PROBE_STAIRCASE | PROBE_RETURN,
    .probe = probe,
    .searched = 3U,
    .accuracy = {0.01}};

const block_t block_charge_leakage = {.name = "charge_leakage",
                                      .place = PLACE_SLOW,
                                      .order = 30,
                                      .text = "the position returns to rest as the charge leaks away",
                                      .parameter = parameters,
                                      .parameters = 3,
                                      .state_bytes = sizeof(state_t),
                                      .open = open,
                                      .settle = settle,
                                      .step = step,
                                      .uncorrected =
                                          "to hold a position against it takes a drive that grows without bound",
                                      .probe = &looked_for};
