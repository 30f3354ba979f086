/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * One mode of the mechanics: y'' + 2 zeta omega y' + omega^2 y = omega^2 u, gain 1 at rest.
 *
 * Between samples u is a polynomial of the time since the last one, a0 + a1 t + a2 t^2 + a3 t^3: the cubic or the line
 * of smooth_drive.h. Another polynomial, b, solves the equation for it; what y deviates from that obeys the equation
 * without input, whose solution over one sample is a constant 2-by-2 matrix.
 */
#include "catalogue.h"
#include "compile_job.h"
#include "smooth_drive.h"
#include <gsl/gsl_math.h>

static const parameter_info_t parameters[] = {
    {.name = "frequency_hz", .unit = "Hz", .low = 1e-3, .high = 1e9, .text = "undamped natural frequency"},
    {.name = "damping_ratio", .unit = "1", .low = 1e-5, .high = 0.999, .text = "of critical damping"}};

typedef struct {
    drive_window_t drive;
    double output, rate; /* y, y' at the last sample; y' per sample */
    double lag, square;  /* 2 zeta / omega, 1 / omega^2 in samples */
    double transition[2][2];
} state_t;

/* Slower modes, in rad per sample, do not see the difference between a line and a cubic, and b would be large. */
static const double slow = 0.01;

static void open(void *memory, const parameter_t *parameter, const stage_setup_t *setup) {
    state_t *state = memory;
    const double omega = 2.0 * M_PI * parameter[0].value[0] / setup->sample_rate_hz; /* rad per sample */
    const double zeta = parameter[1].value[0], damped = omega * sqrt(1.0 - zeta * zeta);
    const double decay = exp(-zeta * omega), c = decay * cos(damped), s = decay * sin(damped) / damped;
    state->lag = 2.0 * zeta / omega;
    state->square = 1.0 / (omega * omega);
    state->transition[0][0] = c + zeta * omega * s;
    state->transition[0][1] = s;
    state->transition[1][0] = -omega * omega * s;
    state->transition[1][1] = c - zeta * omega * s;
}

static void settle(void *memory, signal_t *signal) {
    state_t *state = memory;
    drive_window_settle(&state->drive, signal->value);
    state->output = signal->value;
    state->rate = 0.0;
}

static void step(void *memory, signal_t *signal) {
    state_t *state = memory;
    const double *x = state->drive.x;
    drive_window_next(&state->drive, signal);
    const double part = state->square < 1.0 / (slow * slow) ? state->drive.smooth : 0.0;
    const double line = x[2] - x[3];
    const double a1 = line + part * ((6.0 * x[2] - x[1] - 3.0 * x[3] - 2.0 * x[4]) / 6.0 - line),
                 a2 = part * (x[2] - 2.0 * x[3] + x[4]) / 2.0,
                 a3 = part * (x[1] - 3.0 * x[2] + 3.0 * x[3] - x[4]) / 6.0;
    const double b3 = a3, b2 = a2 - 3.0 * state->lag * b3, b1 = a1 - 2.0 * state->lag * b2 - 6.0 * state->square * b3,
                 b0 = x[3] - state->lag * b1 - 2.0 * state->square * b2;
    const double d = state->output - b0, d_rate = state->rate - b1;
    state->output = b0 + b1 + b2 + b3 + state->transition[0][0] * d + state->transition[0][1] * d_rate;
    state->rate = b1 + 2.0 * b2 + 3.0 * b3 + state->transition[1][0] * d + state->transition[1][1] * d_rate;
    signal->value = state->output;
}

static bool compile(compile_job_t *job, const parameter_t *parameter) {
    return compile_shape(
        job, invert_mode(parameter[0].value[0], parameter[1].value[0], job->rate_hz, job->options->no_filters));
}

static bool probe(const probe_setting_t *setting, size_t index, double *value) {
    /* Where the residual has lines, and everywhere. */
    value[1] = index % 2 == 0 ? 0.01 : 0.1;
    index /= 2;
    if (index < setting->lines) {
        value[0] = setting->line_hz[index];
        return true;
    }
    return probe_between(setting->sample_rate_hz / 2.5, 4.0 / setting->longest_s, 24, index - setting->lines, value);
}

static const probe_t looked_for = {
    .group = "resonance",
    .explanation =
        "The mechanics ring: a gain that grows towards one frequency, and oscillation at it after every edge.",
    .excitation = "a chirp through the mode, or edges",
    .parts = PROBE_FAST_TRIANGLE | PROBE_CHIRPS,
    .probe = probe,
    .searched = 3U,
    .accuracy = {0.001, 0.04},
    .most = {0.0, 0.2}};

const block_t block_resonance = {.name = "resonance",
                                 .place = PLACE_MECHANICS,
                                 .text = "inertia and damping: one mode of the mechanics",
                                 .parameter = parameters,
                                 .parameters = 2,
                                 .state_bytes = sizeof(state_t),
                                 .open = open,
                                 .settle = settle,
                                 .step = step,
                                 .compile = compile,
                                 .probe = &looked_for};
