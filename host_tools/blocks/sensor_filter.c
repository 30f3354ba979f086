/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Sensor electronics or an anti-alias filter that is a low pass of second order, such as a Butterworth filter. */
#include "chain/catalogue.h"
#include "compile/compile_job.h"
#include "elements/low_pass_filter.h"

static bool compile(compile_job_t *job, const parameter_t *parameter) {
    return compile_shape(
        job, invert_low_pass(parameter[0].value[0], parameter[1].value[0], job->rate_hz, job->options->no_filters));
}

static const probe_t looked_for = {
    .group = "lag",
    .in_place_of = {"lag", "resonance"},
    .explanation = "The readings follow the position through a low pass of second order, behind the hysteresis.",
    .excitation = "measured voltage on the same clock, and a chirp up to the cutoff",
    .parts = PROBE_FAST_TRIANGLE | PROBE_CHIRPS,
    .probe = low_pass_filter_probe,
    .rings = low_pass_filter_rings,
    .searched = 3U,
    .accuracy = {0.02, 0.04}};

const block_t block_sensor_filter = {.name = "sensor_filter",
                                     .place = PLACE_SENSOR,
                                     .order = 15,
                                     .text = "second-order low pass of the position sensor or its anti-alias filter",
                                     .smooths = true,
                                     .parameter = low_pass_filter_parameters,
                                     .parameters = LOW_PASS_FILTER_PARAMETERS,
                                     .state_bytes = sizeof(oscillator_stage_t),
                                     .open = oscillator_stage_open,
                                     .settle = oscillator_stage_settle,
                                     .step = oscillator_stage_step,
                                     .compile = compile,
                                     .probe = &looked_for};
