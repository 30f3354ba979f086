/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "elements/first_order_lag.h"
#include <gsl/gsl_math.h>

const parameter_info_t first_order_lag_parameters[1] = {{.name = "cutoff_hz",
                                                         .unit = "Hz",
                                                         .low = 1e-3,
                                                         .high = 1e9,
                                                         .text = "frequency at which the gain is down by 3 dB"}};

/* moment[n]: integral over one sample of x exp(-x (1 - s)) s^n, s from 0 (the sample before) to 1; x: sample times
 * decay rate. moment[n] = 1 - n / x moment[n-1], in the direction in which errors decay. */
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

/* The same where s is held at the end of each of so many steps: the sum over steps in place of the integral. */
static void moments_of_steps(double x, size_t steps, double moment[4]) {
    for (int n = 0; n < 4; n++) {
        moment[n] = 0.0;
    }
    for (size_t j = 1; j <= steps; j++) {
        const double s = (double)j / (double)steps, decayed = -expm1(-x / (double)steps) * exp(-x * (1.0 - s));
        for (int n = 0; n < 4; n++) {
            moment[n] += decayed * gsl_pow_int(s, n);
        }
    }
}

void first_order_lag_set(first_order_lag_t *lag, double cutoff_hz, double sample_rate_hz, size_t steps) {
    const double x = 2.0 * M_PI * cutoff_hz / sample_rate_hz;
    double m[4];
    if (steps > 1) {
        moments_of_steps(x, steps, m);
    } else {
        moments(x, m);
    }
    lag->decays = x;
    lag->decay = exp(-x);
    lag->line[0] = m[1];
    lag->line[1] = m[0] - m[1];
    /* Lagrange polynomials of the nodes s = 2, 1, 0, -1: polynomial i is 1 at node i. */
    lag->cubic[0] = (m[3] - m[1]) / 6.0;
    lag->cubic[1] = (2.0 * m[1] + m[2] - m[3]) / 2.0;
    lag->cubic[2] = (2.0 * m[0] - m[1] - 2.0 * m[2] + m[3]) / 2.0;
    lag->cubic[3] = (-2.0 * m[1] + 3.0 * m[2] - m[3]) / 6.0;
}

void first_order_lag_hold(first_order_lag_t *lag, double held_since) {
    lag->held = true;
    lag->hold[0] = -expm1(-lag->decays * held_since);
    lag->hold[1] = -exp(-lag->decays * held_since) * expm1(-lag->decays * (1.0 - held_since));
}

double first_order_lag_next(first_order_lag_t *lag, const drive_window_t *drive) {
    const double *x = drive->x;
    if (lag->held) {
        lag->output = lag->decay * lag->output + lag->hold[0] * x[2] + lag->hold[1] * x[3];
        return lag->output;
    }
    const double line = lag->line[0] * x[2] + lag->line[1] * x[3];
    const double cubic = lag->cubic[0] * x[1] + lag->cubic[1] * x[2] + lag->cubic[2] * x[3] + lag->cubic[3] * x[4];
    lag->output = lag->decay * lag->output + line + drive->smooth * (cubic - line);
    return lag->output;
}

void first_order_stage_open(void *memory, const parameter_t *parameter, const stage_setup_t *setup) {
    first_order_stage_t *stage = memory;
    first_order_lag_set(&stage->lag, parameter[0].value[0], setup->sample_rate_hz, setup->steps);
    if (setup->held) {
        first_order_lag_hold(&stage->lag, setup->held_since);
    }
}

void first_order_stage_settle(void *memory, signal_t *signal) {
    first_order_stage_t *stage = memory;
    drive_window_settle(&stage->drive, signal->value);
    stage->lag.output = signal->value;
}

void first_order_stage_step(void *memory, signal_t *signal) {
    first_order_stage_t *stage = memory;
    drive_window_next(&stage->drive, signal);
    signal->value = first_order_lag_next(&stage->lag, &stage->drive);
}

double first_order_stage_turn(const first_order_stage_t *stage, double last) {
    const double *x = stage->drive.x, slope = x[2] - x[3], behind = slope / stage->lag.decays;
    if (stage->lag.held) { /* towards one value, then towards another: where that changes is not followed */
        return last;
    }
    const double ratio = 1.0 + (last - x[3]) / behind;
    const double when = ratio > 1.0 ? log(ratio) / stage->lag.decays : 1.0;
    return when < 1.0 ? x[3] + slope * when : last;
}
