/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Inertia and damping in play form, as printed in the source: y = u - c u' - m u''. This is the first-order expansion
 * of a mode (block resonance) far below its frequency, with backward differences:
 *
 *     u'  = (3 u[k] - 4 u[k-1] + u[k-2]) / (2 dt),      u'' = (u[k] - 2 u[k-1] + u[k-2]) / dt^2
 *
 * docs/MODELS.md, section 11.
 */
#include "chain/catalogue.h"
#include "compile/compile_job.h"
#include <gsl/gsl_math.h>

static const parameter_info_t parameters[] = {
    {.name = "damping_s", .unit = "s", .low = 0.0, .high = 1.0, .text = "position lost per rate"},
    {.name = "mass_s2", .unit = "s2", .low = 0.0, .high = 1.0, .text = "position lost per acceleration"}};

typedef struct {
    double weight[3]; /* of the present and the two inputs before it; add up to 1 */
    double past[2];
} state_t;

static void open(void *memory, const parameter_t *parameter, const stage_setup_t *setup) {
    state_t *state = memory;
    const double c = parameter[0].value[0] * setup->sample_rate_hz;
    const double m = parameter[1].value[0] * setup->sample_rate_hz * setup->sample_rate_hz;
    state->weight[0] = 1.0 - 1.5 * c - m;
    state->weight[1] = 2.0 * (c + m);
    state->weight[2] = -0.5 * c - m;
}

static void settle(void *memory, signal_t *signal) {
    state_t *state = memory;
    state->past[0] = state->past[1] = signal->value;
}

static void step(void *memory, signal_t *signal) {
    state_t *state = memory;
    const double input = signal->value;
    signal->value = state->weight[0] * input + state->weight[1] * state->past[0] + state->weight[2] * state->past[1];
    state->past[1] = state->past[0];
    state->past[0] = input;
}

/* y = u - c u' - m u'' has no stable inverse, it is the expansion of one that has: u = y + c y' + m y'' to first order,
 * which is undone as the mode or the two lags that it is. */
static bool compile(compile_job_t *job, const parameter_t *parameter) {
    const double c = parameter[0].value[0], m = parameter[1].value[0], spread = c * c - 4.0 * m;
    const bool plain = job->options->no_filters;
    if (spread < 0.0) {
        return compile_shape(job, invert_mode(0.5 * M_1_PI / sqrt(m), 0.5 * c / sqrt(m), job->rate_hz, plain));
    }
    const double slow_s = 0.5 * (c + sqrt(spread)), fast_s = slow_s > 0.0 ? m / slow_s : 0.0;
    const double least_s = 1e-3 / job->rate_hz; /* below, no inverse is needed */
    return (slow_s < least_s || compile_shape(job, invert_lag(0.5 * M_1_PI / slow_s, job->rate_hz, plain))) &&
           (fast_s < least_s || compile_shape(job, invert_lag(0.5 * M_1_PI / fast_s, job->rate_hz, plain)));
}

const block_t block_inertial_terms = {.name = "inertial_terms",
                                      .place = PLACE_MECHANICS,
                                      .order = 20,
                                      .text = "inertia and damping to first order: less c rate and m acceleration",
                                      .parameter = parameters,
                                      .parameters = 2,
                                      .state_bytes = sizeof(state_t),
                                      .open = open,
                                      .settle = settle,
                                      .step = step,
                                      .compile = compile};
