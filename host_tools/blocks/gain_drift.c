/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * A gain that changes with time, as while an actuator or its amplifier warms up. With x the position less center,
 *
 *     change = gain t x,    or, where it settles, gain T (1 - exp(-t / T)) x
 *
 * Whether it settles is looked for once it was found.
 */
#include "chain/catalogue.h"
#include <math.h>

enum { GAIN, CENTER, TIME_CONSTANT };

static const parameter_info_t parameters[] = {{.name = "gain_per_s",
                                               .proportional = true,
                                               .unit = "1/s",
                                               .low = -1.0,
                                               .high = 1.0,
                                               .text = "change of the gain in the beginning, as a part of it"},
                                              {.name = "center_um",
                                               .unit = "um",
                                               .low = -1e9,
                                               .high = 1e9,
                                               .optional = true,
                                               .text = "position that the gain leaves where it is"},
                                              {.name = "time_constant_s",
                                               .unit = "s",
                                               .low = 0.0,
                                               .high = 1e9,
                                               .optional = true,
                                               .text = "in which it settles; 0: it goes on"}};

typedef struct {
    double gain_per_sample, center_um;
    double samples_per_constant; /* 0: it goes on */
    uint64_t samples;            /* since the recording began */
} state_t;

static void open(void *memory, const parameter_t *parameter, const stage_setup_t *setup) {
    state_t *state = memory;
    state->gain_per_sample = parameter[GAIN].value[0] / setup->sample_rate_hz;
    state->center_um = parameter[CENTER].value[0];
    state->samples_per_constant = parameter[TIME_CONSTANT].value[0] * setup->sample_rate_hz;
}

static void settle(void *memory, signal_t *signal) {
    (void)signal;
    ((state_t *)memory)->samples = 0;
}

static void step(void *memory, signal_t *signal) {
    state_t *state = memory;
    const double samples = (double)state->samples++, constant = state->samples_per_constant;
    const double grown = constant > 0.0 ? -constant * expm1(-samples / constant) : samples;
    signal->value += state->gain_per_sample * grown * (signal->value - state->center_um);
}

static bool probe(const probe_setting_t *setting, size_t index, double *value) {
    value[GAIN] = 1e-3 / setting->longest_s;
    value[CENTER] = 0.0;
    return index == 0;
}

/* An actuator's gain leaves the position at 0 V where it is, a sensor's its own zero. */
static double join(const probe_setting_t *setting, const double *value, size_t parameter) {
    const double drive_v = setting->drive_high_v - setting->drive_low_v;
    const double gain = drive_v > 0.0 ? (setting->displacement_high_um - setting->displacement_low_um) / drive_v : 0.0;
    (void)value;
    return parameter == TIME_CONSTANT ? 0.5 * setting->longest_s
                                      : setting->displacement_low_um - gain * setting->drive_low_v;
}

static const probe_t looked_for = {.group = "slow",
                                   .explanation =
                                       "The gain changes with time: the error goes with the position and with time.",
                                   .excitation = "the same small fast sweep repeated over the whole time",
                                   .parts = PROBE_STAIRCASE | PROBE_BURST | PROBE_RETURN,
                                   .probe = probe,
                                   .searched = 1U << GAIN,
                                   .joins = 1U << TIME_CONSTANT | 1U << CENTER,
                                   .join = join,
                                   .accuracy = {0.01}};

const block_t block_gain_drift = {
    .name = "gain_drift",
    .place = PLACE_SLOW,
    .order = 40,
    .text = "gain that changes with time, steadily or until it has settled",
    .parameter = parameters,
    .parameters = 3,
    .state_bytes = sizeof(state_t),
    .open = open,
    .settle = settle,
    .step = step,
    .uncorrected = "it grows with the time since the recording began, which the amplifier does not know",
    .probe = &looked_for};
