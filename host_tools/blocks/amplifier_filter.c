/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Amplifier whose output follows its input as a low pass of second order does, such as a Butterworth filter. */
#include "chain/catalogue.h"
#include "compile/compile_job.h"
#include "elements/low_pass_filter.h"

/* The following hysteresis remembers where the voltage reversed; after a sensor nothing does. */
static void step(void *memory, signal_t *signal) {
    const oscillator_stage_t *stage = memory;
    const double before[2] = {stage->state[0], stage->state[1]};
    oscillator_stage_step(memory, signal);
    signal_turns(signal, before[0], oscillator_stage_turn(stage, before));
}

static bool compile(compile_job_t *job, const parameter_t *parameter) {
    return compile_equalise(
        job, invert_low_pass(parameter[0].value[0], parameter[1].value[0], job->rate_hz, job->options->no_filters));
}

static const probe_t looked_for = {
    .group = "lag",
    .in_place_of = {"lag", "resonance"},
    .explanation = "The voltage follows the command through a low pass of second order, before the hysteresis.",
    .excitation = "measured voltage on the same clock; a chirp up to the cutoff at two amplitudes",
    .parts = PROBE_FAST_TRIANGLE | PROBE_CHIRPS,
    .probe = low_pass_filter_probe,
    .rings = low_pass_filter_rings,
    .searched = 3U,
    .accuracy = {0.02, 0.04}};

const block_t block_amplifier_filter = {.name = "amplifier_filter",
                                        .place = PLACE_ELECTRONICS,
                                        .order = 25,
                                        .text = "second-order low pass of the amplifier or its input filter",
                                        .smooths = true,
                                        .parameter = low_pass_filter_parameters,
                                        .parameters = LOW_PASS_FILTER_PARAMETERS,
                                        .state_bytes = sizeof(oscillator_stage_t),
                                        .open = oscillator_stage_open,
                                        .settle = oscillator_stage_settle,
                                        .step = step,
                                        .compile = compile,
                                        .probe = &looked_for};
