/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Pure delay. Between samples the drive is the cubic through the four around the delayed instant, or a straight line
 * (smooth_drive.h). */
#include "chain/catalogue.h"
#include "chain/smooth_drive.h"
#include "compile/compile_job.h"
#include <math.h>

static const parameter_info_t parameters[] = {{.name = "delay_s",
                                               .proportional = true,
                                               .unit = "s",
                                               .low = 0.0,
                                               .high = 1.0,
                                               .text = "from drive command to voltage"}};

typedef struct {
    size_t length, newest; /* of the ring */
    size_t whole;          /* samples of the delay; it goes on to the one before by */
    double fraction;       /* of a sample, 0 to 1 */
    bool held;             /* the input is: whole samples, and what follows knows the rest (held_later) */
    double weight[4];      /* of the cubic */
    double output;         /* of the last sample */
    double ring[];
} state_t;

static size_t whole_samples(const parameter_t *parameter, const stage_setup_t *setup) {
    const double samples = parameter[0].value[0] * setup->sample_rate_hz;
    double whole = floor(samples);
    if (setup->held) {
        (void)held_later(setup->held_since, samples, &whole);
    }
    return (size_t)whole;
}

static size_t ring_length(size_t whole) {
    return whole + 4;
}

static size_t further_bytes(const parameter_t *parameter, const stage_setup_t *setup) {
    return ring_length(whole_samples(parameter, setup)) * sizeof(double);
}

static void open(void *memory, const parameter_t *parameter, const stage_setup_t *setup) {
    state_t *state = memory;
    state->whole = whole_samples(parameter, setup);
    state->length = ring_length(state->whole);
    state->held = setup->held;
    state->fraction = setup->held ? 0.0 : parameter[0].value[0] * setup->sample_rate_hz - (double)state->whole;
    smooth_drive_weights(state->fraction, state->weight);
}

static void settle(void *memory, signal_t *signal) {
    state_t *state = memory;
    for (size_t i = 0; i < state->length; i++) {
        state->ring[i] = signal->value;
    }
    state->output = signal->value;
}

/* The value this many samples ago, or ahead if negative; 0 if it is not known. */
static double sample(const state_t *state, const signal_t *signal, ptrdiff_t ago) {
    if (ago < 0) {
        return (size_t)-ago <= signal->known_ahead ? signal->ahead[-ago - 1] : 0.0;
    }
    return state->ring[(state->newest + state->length - (size_t)ago) % state->length];
}

static void step(void *memory, signal_t *signal) {
    state_t *state = memory;
    const double last = state->output;
    double x[6];
    state->newest = (state->newest + 1) % state->length;
    state->ring[state->newest] = signal->value;
    if (state->held) {
        signal->value = sample(state, signal, (ptrdiff_t)state->whole);
        return;
    }
    for (ptrdiff_t i = 0; i < 6; i++) {
        x[i] = sample(state, signal, (ptrdiff_t)state->whole - 2 + i);
    }
    /* The delayed instant is between the inner two. */
    state->output = smooth_drive_value(x, signal->known_ahead + state->whole, state->fraction, state->weight);
    signal->value = state->output;
    signal_turns(signal, last, x[3]); /* the one sample between the two delayed instants */
}

static bool compile(compile_job_t *job, const parameter_t *parameter) {
    job->delay_s += parameter[0].value[0];
    compile_note(job, "%s: the amplifier looks %.4g ms ahead, as far as samples allow", job->block,
                 1e3 * parameter[0].value[0]);
    return true;
}

/* A held drive comes late by whole samples, unless something behind it takes its time. From another number of them no
 * fit finds there, so each has a probe: in the middle of the delays that are the same. */
static bool probe(const probe_setting_t *setting, size_t index, double *value) {
    enum { MOST_HELD = 40 };
    static const double samples[] = {0.25, 1.0};
    const size_t usual = sizeof samples / sizeof samples[0];
    if (index < usual) {
        value[0] = samples[index] / setting->sample_rate_hz;
        return true;
    }
    value[0] = ((double)(index - usual) + 0.5) * setting->held_s + setting->held_since_s;
    return setting->held_s > 0.0 && index - usual < MOST_HELD;
}

static const probe_t looked_for = {
    .group = "lag",
    .explanation = "The position answers later than the model, by the same time at every frequency and without a loss "
                   "of amplitude.",
    .excitation = "measured voltage on the same clock, or fast steps: a delay moves them, a low pass bends them",
    .parts = PROBE_FAST_TRIANGLE | PROBE_CHIRPS,
    .probe = probe,
    .searched = 1U,
    .accuracy = {0.02}};

const block_t block_transport_delay = {.name = "transport_delay",
                                       .place = PLACE_ELECTRONICS,
                                       .order = 10,
                                       .text = "pure delay between command and voltage",
                                       .lag = LAG_DELAY,
                                       .parameter = parameters,
                                       .parameters = 1,
                                       .state_bytes = sizeof(state_t),
                                       .further_bytes = further_bytes,
                                       .open = open,
                                       .settle = settle,
                                       .step = step,
                                       .compile = compile,
                                       .probe = &looked_for};
