/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "first_order_lag.h"
#include "smooth_drive.h"
#include <gsl/gsl_math.h>
#include <string.h>

const parameter_info_t first_order_lag_parameters[1] = {{.name = "cutoff_hz",
                                                         .unit = "Hz",
                                                         .low = 1e-3,
                                                         .high = 1e9,
                                                         .text = "frequency at which the gain is down by 3 dB"}};

/* moment[n]: integral over one sample of x exp(-x (1 - s)) s^n, s from 0 (the sample before) to 1; x: sample times
 * decay rate. moment[n] = 1 - n / x moment[n-1], in the direction that forgets errors. */
static void moments(double x, double moment[4]) {
    enum { FIRST = 30 };
    moment[0] = -expm1(-x);
    if (x > 4.0) {
        for (int n = 1; n < 4; n++) {
            moment[n] = 1.0 - n / x * moment[n - 1];
        }
    } else {
        double next = x / (FIRST + 1.0);
        for (int n = FIRST; n > 1; n--) {
            next = x / n * (1.0 - next);
            if (n <= 4) {
                moment[n - 1] = next;
            }
        }
    }
}

void first_order_lag_set(first_order_lag_t *lag, double cutoff_hz, double sample_rate_hz) {
    const double x = 2.0 * M_PI * cutoff_hz / sample_rate_hz;
    double m[4];
    moments(x, m);
    lag->decays = x;
    lag->decay = exp(-x);
    lag->line[0] = m[1];
    lag->line[1] = m[0] - m[1];
    /* Lagrange's polynomials of the nodes s = 2, 1, 0, -1, each 1 at its own. */
    lag->cubic[0] = (m[3] - m[1]) / 6.0;
    lag->cubic[1] = (2.0 * m[1] + m[2] - m[3]) / 2.0;
    lag->cubic[2] = (2.0 * m[0] - m[1] - 2.0 * m[2] + m[3]) / 2.0;
    lag->cubic[3] = (-2.0 * m[1] + 3.0 * m[2] - m[3]) / 6.0;
}

double first_order_lag_turn(const first_order_lag_t *lag, double last) {
    const double slope = lag->input[0] - lag->input[1], behind = slope / lag->decays;
    const double ratio = 1.0 + (last - lag->input[1]) / behind;
    const double when = ratio > 1.0 ? log(ratio) / lag->decays : 1.0;
    return when < 1.0 ? lag->input[1] + slope * when : last;
}

void first_order_lag_open(void *memory, const parameter_t *parameter, const stage_setup_t *setup) {
    first_order_lag_set(memory, parameter[0].value[0], setup->sample_rate_hz);
}

void first_order_lag_settle(void *memory, signal_t *signal) {
    first_order_lag_t *state = memory;
    for (int i = 0; i < 4; i++) {
        state->input[i] = signal->value;
    }
    state->output = signal->value;
}

void first_order_lag_step(void *memory, signal_t *signal) {
    first_order_lag_t *state = memory;
    double *u = state->input;
    memmove(u + 1, u, 3 * sizeof *u);
    u[0] = signal->value;
    const double x[6] = {signal->ahead[1], signal->ahead[0], u[0], u[1], u[2], u[3]};
    const double line = state->line[0] * u[0] + state->line[1] * u[1];
    const double cubic =
        state->cubic[0] * x[1] + state->cubic[1] * x[2] + state->cubic[2] * x[3] + state->cubic[3] * x[4];
    state->output = state->decay * state->output + line + smooth_drive(x, signal->known_ahead) * (cubic - line);
    signal->value = state->output;
}
