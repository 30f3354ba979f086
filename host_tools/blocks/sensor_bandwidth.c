/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "chain/catalogue.h"
#include "compile/compile_job.h"
#include "elements/first_order_lag.h"

static bool compile(compile_job_t *job, const parameter_t *parameter) {
    return compile_shape(job, invert_lag(parameter[0].value[0], job->rate_hz, job->options->no_filters));
}

static bool probe(const probe_setting_t *setting, size_t index, double *value) {
    return probe_between(setting->sample_rate_hz / 4.0, 4.0 / setting->longest_s, 8, index, value);
}

static const probe_t looked_for = {.group = "lag",
                                   .explanation =
                                       "The sensor follows the position through a low pass, behind the hysteresis.",
                                   .excitation = "measured voltage on the same clock, and a faster sensor",
                                   .parts = PROBE_FAST_TRIANGLE | PROBE_CHIRPS,
                                   .probe = probe,
                                   .searched = 1U,
                                   .accuracy = {0.02}};

const block_t block_sensor_bandwidth = {.name = "sensor_bandwidth",
                                        .place = PLACE_SENSOR,
                                        .order = 10,
                                        .text = "first-order low pass of the position sensor",
                                        .lag = LAG_LOW_PASS,
                                        .twin = "amplifier_bandwidth",
                                        .smooths = true,
                                        .parameter = first_order_lag_parameters,
                                        .parameters = 1,
                                        .state_bytes = sizeof(first_order_stage_t),
                                        .open = first_order_stage_open,
                                        .settle = first_order_stage_settle,
                                        .step = first_order_stage_step,
                                        .compile = compile,
                                        .probe = &looked_for};
