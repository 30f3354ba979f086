/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Pure delay. Between samples the drive is taken as linear, which is what the other blocks assume too. */
#include "catalogue.h"
#include "compile_job.h"
#include <math.h>

static const parameter_info_t parameters[] = {{.name = "delay_s",
                                               .proportional = true,
                                               .unit = "s",
                                               .low = 0.0,
                                               .high = 1.0,
                                               .text = "from drive command to voltage"}};

typedef struct {
    size_t length, newest; /* of the ring */
    double fraction;       /* of a sample, 0 to 1 */
    double ring[];
} state_t;

static size_t whole_samples(const parameter_t *parameter, const stage_setup_t *setup) {
    return (size_t)floor(parameter[0].value[0] * setup->sample_rate_hz);
}

static size_t further_bytes(const parameter_t *parameter, const stage_setup_t *setup) {
    return (whole_samples(parameter, setup) + 2) * sizeof(double);
}

static void open(void *memory, const parameter_t *parameter, const stage_setup_t *setup) {
    state_t *state = memory;
    const size_t whole = whole_samples(parameter, setup);
    state->length = whole + 2; /* the two samples around the delayed instant and all since */
    state->fraction = parameter[0].value[0] * setup->sample_rate_hz - (double)whole;
}

static void settle(void *memory, signal_t *signal) {
    state_t *state = memory;
    for (size_t i = 0; i < state->length; i++) {
        state->ring[i] = signal->value;
    }
}

static void step(void *memory, signal_t *signal) {
    state_t *state = memory;
    const size_t newest = (state->newest + 1) % state->length, oldest = (newest + 1) % state->length;
    const size_t next = (oldest + 1) % state->length;
    state->ring[newest] = signal->value;
    state->newest = newest;
    signal->value = state->ring[next] + state->fraction * (state->ring[oldest] - state->ring[next]);
}

static bool compile(compile_job_t *job, const parameter_t *parameter) {
    job->delay_s += parameter[0].value[0];
    return true;
}

static bool probe(const probe_setting_t *setting, size_t index, double *value) {
    value[0] = 0.25 / setting->sample_rate_hz;
    return index == 0;
}

static const probe_t looked_for = {
    .group = "lag",
    .explanation = "The position answers later than the model, by the same time at every frequency and without a loss "
                   "of amplitude.",
    .excitation = "measured voltage on the same clock, or fast steps: a delay moves them, a low pass bends them",
    .parts = PROBE_FAST_TRIANGLE | PROBE_CHIRPS,
    .probe = probe,
    .searched = 1U};

const block_t block_transport_delay = {.name = "transport_delay",
                                       .place = PLACE_ELECTRONICS,
                                       .text = "pure delay between command and voltage",
                                       .parameter = parameters,
                                       .parameters = 1,
                                       .state_bytes = sizeof(state_t),
                                       .further_bytes = further_bytes,
                                       .open = open,
                                       .settle = settle,
                                       .step = step,
                                       .compile = compile,
                                       .probe = &looked_for};
