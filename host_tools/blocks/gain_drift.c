/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A gain that changes steadily, as while an actuator or its amplifier warms up. */
#include "chain/catalogue.h"

enum { GAIN, CENTER };

static const parameter_info_t parameters[] = {{.name = "gain_per_s",
                                               .proportional = true,
                                               .unit = "1/s",
                                               .low = -1.0,
                                               .high = 1.0,
                                               .text = "change of the gain, as a part of it"},
                                              {.name = "center_um",
                                               .unit = "um",
                                               .low = -1e9,
                                               .high = 1e9,
                                               .optional = true,
                                               .text = "position that the gain leaves where it is"}};

typedef struct {
    double gain_per_sample, center_um;
    uint64_t samples; /* since the recording began */
} state_t;

static void open(void *memory, const parameter_t *parameter, const stage_setup_t *setup) {
    state_t *state = memory;
    state->gain_per_sample = parameter[GAIN].value[0] / setup->sample_rate_hz;
    state->center_um = parameter[CENTER].value[0];
}

static void settle(void *memory, signal_t *signal) {
    (void)signal;
    ((state_t *)memory)->samples = 0;
}

static void step(void *memory, signal_t *signal) {
    state_t *state = memory;
    signal->value += state->gain_per_sample * (double)state->samples++ * (signal->value - state->center_um);
}

static bool probe(const probe_setting_t *setting, size_t index, double *value) {
    value[GAIN] = 1e-3 / setting->longest_s;
    value[CENTER] = 0.0;
    return index == 0;
}

static const probe_t looked_for = {.group = "slow",
                                   .explanation =
                                       "The gain changes steadily: the error goes with the position and with time.",
                                   .excitation = "the same small fast sweep repeated over the whole time",
                                   .parts = PROBE_STAIRCASE | PROBE_BURST | PROBE_RETURN,
                                   .probe = probe,
                                   .searched = 1U << GAIN,
                                   .accuracy = {0.01}};

const block_t block_gain_drift = {
    .name = "gain_drift",
    .place = PLACE_SLOW,
    .order = 40,
    .text = "gain that changes in proportion to time",
    .parameter = parameters,
    .parameters = 2,
    .state_bytes = sizeof(state_t),
    .open = open,
    .settle = settle,
    .step = step,
    .uncorrected = "it grows with the time since the recording began, which the amplifier does not know",
    .probe = &looked_for};
