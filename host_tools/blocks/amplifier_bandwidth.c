/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The amplifier's output stage with the actuator's capacitance as its load. */
#include "chain/catalogue.h"
#include "compile/compile_job.h"
#include "elements/first_order_lag.h"

/* The following hysteresis remembers where the voltage reversed; after a sensor nothing does. */
static void step(void *memory, signal_t *signal) {
    const first_order_stage_t *stage = memory;
    const double last = stage->lag.output;
    first_order_stage_step(memory, signal);
    signal_turns(signal, last, first_order_stage_turn(stage, last));
}

static bool compile(compile_job_t *job, const parameter_t *parameter) {
    return compile_equalise(job, invert_lag(parameter[0].value[0], job->rate_hz, job->options->no_filters));
}

static bool probe(const probe_setting_t *setting, size_t index, double *value) {
    return probe_between(setting->sample_rate_hz / 4.0, 4.0 / setting->longest_s, 8, index, value);
}

static const probe_t looked_for = {.group = "lag",
                                   .explanation = "The voltage follows the command through a low pass: lag and loss of "
                                                  "amplitude grow with frequency, before the hysteresis.",
                                   .excitation =
                                       "measured voltage on the same clock; the same frequencies at two amplitudes",
                                   .parts = PROBE_FAST_TRIANGLE | PROBE_CHIRPS,
                                   .probe = probe,
                                   .searched = 1U,
                                   .accuracy = {0.02}};

const block_t block_amplifier_bandwidth = {.name = "amplifier_bandwidth",
                                           .place = PLACE_ELECTRONICS,
                                           .order = 20,
                                           .text = "first-order low pass of the amplifier and its load",
                                           .lag = LAG_LOW_PASS,
                                           .twin = "sensor_bandwidth",
                                           .smooths = true,
                                           .parameter = first_order_lag_parameters,
                                           .parameters = 1,
                                           .state_bytes = sizeof(first_order_stage_t),
                                           .open = first_order_stage_open,
                                           .settle = first_order_stage_settle,
                                           .step = step,
                                           .compile = compile,
                                           .probe = &looked_for};
