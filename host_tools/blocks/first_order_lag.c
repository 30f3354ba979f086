/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "first_order_lag.h"
#include <gsl/gsl_math.h>

const parameter_info_t first_order_lag_parameters[1] = {{.name = "cutoff_hz",
                                                         .unit = "Hz",
                                                         .low = 1e-3,
                                                         .high = 1e9,
                                                         .text = "frequency at which the gain is down by 3 dB"}};

void first_order_lag_set(first_order_lag_t *lag, double cutoff_hz, double sample_rate_hz) {
    const double x = 2.0 * M_PI * cutoff_hz / sample_rate_hz;
    const double mean = -expm1(-x) / x; /* of the decay over one sample */
    lag->decay = exp(-x);
    lag->present = 1.0 - mean;
    lag->past = mean - lag->decay;
}

void first_order_lag_open(void *memory, const parameter_t *parameter, const stage_setup_t *setup) {
    first_order_lag_set(memory, parameter[0].value[0], setup->sample_rate_hz);
}

void first_order_lag_settle(void *memory, signal_t *signal) {
    first_order_lag_t *state = memory;
    state->input = signal->value;
    state->output = signal->value;
}

void first_order_lag_step(void *memory, signal_t *signal) {
    first_order_lag_t *state = memory;
    state->output = state->decay * state->output + state->present * signal->value + state->past * state->input;
    state->input = signal->value;
    signal->value = state->output;
}
