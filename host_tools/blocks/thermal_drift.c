/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Thermal expansion while sensor and frame warm up: an exponential in time, independent of the drive. */
#include "chain/catalogue.h"
#include <math.h>

enum { DRIFT, TIME_CONSTANT };

static const parameter_info_t parameters[] = {
    {.name = "drift_um",
     .proportional = true,
     .unit = "um",
     .low = -1e6,
     .high = 1e6,
     .text = "final change of the reading"},
    {.name = "time_constant_s", .unit = "s", .low = 1e-3, .high = 1e9, .text = "in which all but 1/e has happened"}};

typedef struct {
    double drift_um, time_constant; /* um, samples */
    uint64_t samples;               /* since the recording began */
} state_t;

static void open(void *memory, const parameter_t *parameter, const stage_setup_t *setup) {
    state_t *state = memory;
    state->drift_um = parameter[DRIFT].value[0];
    state->time_constant = parameter[TIME_CONSTANT].value[0] * setup->sample_rate_hz;
}

static void settle(void *memory, signal_t *signal) {
    (void)signal;
    ((state_t *)memory)->samples = 0;
}

static void step(void *memory, signal_t *signal) {
    state_t *state = memory;
    signal->value -= state->drift_um * expm1(-(double)state->samples++ / state->time_constant);
}

static bool probe(const probe_setting_t *setting, size_t index, double *value) {
    value[DRIFT] = 1e-3 * (setting->displacement_high_um - setting->displacement_low_um);
    return probe_between(3.0 * setting->longest_s, 0.03 * setting->longest_s, 5, index, &value[TIME_CONSTANT]);
}

static const probe_t looked_for = {
    .group = "slow",
    .explanation = "The reading drifts and settles exponentially, whatever the drive does.",
    .excitation = "silence at rest before and after, and returns to the same voltage",
    .parts = PROBE_SILENCE | PROBE_STAIRCASE | PROBE_BURST | PROBE_RETURN,
    .probe = probe,
    .searched = 1U << DRIFT | 1U << TIME_CONSTANT,
    .accuracy = {0.01},
    .doubtful = {.beside = "creep", .size_um = "drift_um", .part_of_range = "gamma_per_decade"}};

const block_t block_thermal_drift = {
    .name = "thermal_drift",
    .place = PLACE_SENSOR,
    .order = 30,
    .adds = true,
    .text = "offset that settles exponentially, whatever the drive does",
    .follows_temperature = true,
    .parameter = parameters,
    .parameters = 2,
    .state_bytes = sizeof(state_t),
    .open = open,
    .settle = settle,
    .step = step,
    .uncorrected = "it goes on whatever the drive does, and without a second sensor the amplifier cannot see it",
    .probe = &looked_for};
