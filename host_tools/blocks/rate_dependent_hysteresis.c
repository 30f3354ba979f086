/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Thresholds that grow with the drive rate: the discrete form of lib/hyst (prandtl_ishlinskii.h), where the rate at
 * sample k is the one known before sample k, so that the inverse is exact.
 *
 *     growth[k] = min(beta_s |v[k-1]| / dt, limit_v),     v[k] = v[k-1] + g (u[k] - u[k-1] - v[k-1]),     g = 1 -
 * exp(-dt / rate_filter_s)
 */
#include "catalogue.h"
#include "compile_job.h"
#include <math.h>

static const parameter_info_t parameters[] = {
    {.name = "beta_s",
     .proportional = true,
     .unit = "s",
     .low = 0.0,
     .high = 1e3,
     .text = "threshold growth per drive rate"},
    {.name = "rate_filter_s",
     .unit = "s",
     .low = 0.0,
     .high = 1e3,
     .optional = true,
     .text = "time constant that smooths the drive rate, 0 for none"},
    {.name = "limit_v",
     .unit = "V",
     .low = 0.0,
     .high = 1e9,
     .optional = true,
     .default_value = HUGE_VAL,
     .chosen = true,
     .text = "largest growth; the amplifier's is half its drive range less its largest threshold"}};

typedef struct {
    double beta_samples, rate_gain, limit_v;
    double input, rate; /* V, V per sample */
} state_t;

static void open(void *memory, const parameter_t *parameter, const stage_setup_t *setup) {
    state_t *state = memory;
    const double filter_s = parameter[1].value[0];
    state->beta_samples = parameter[0].value[0] * setup->sample_rate_hz;
    state->rate_gain = filter_s > 0.0 ? -expm1(-1.0 / (filter_s * setup->sample_rate_hz)) : 1.0;
    state->limit_v = parameter[2].value[0];
}

static void settle(void *memory, signal_t *signal) {
    state_t *state = memory;
    state->input = signal->value;
    state->rate = 0.0;
    signal->threshold_growth_v = 0.0;
}

static void step(void *memory, signal_t *signal) {
    state_t *state = memory;
    signal->threshold_growth_v = fmin(state->beta_samples * fabs(state->rate), state->limit_v);
    state->rate += state->rate_gain * (signal->value - state->input - state->rate);
    state->input = signal->value;
}

static bool compile(compile_job_t *job, const parameter_t *parameter) {
    hyst_parameters_t *p = job->parameters;
    const double filter_s = parameter[1].value[0];
    const double gain = filter_s > 0.0 ? -expm1(-1.0 / (filter_s * job->rate_hz)) : 1.0;
    return compile_to_fixed(job, parameter[0].value[0] * job->rate_hz, 20, "beta in samples", &p->pi_beta) &&
           compile_to_fixed(job, gain, 30, "rate gain", &p->pi_rate_gain);
}

static bool probe(const probe_setting_t *setting, size_t index, double *value) {
    /* Thresholds grow by 5 % of half the range at the largest rate. */
    value[0] = 0.025 * (setting->drive_high_v - setting->drive_low_v) / setting->largest_rate_v_per_s;
    value[2] = HUGE_VAL;
    return probe_between(0.5 / setting->sample_rate_hz, 64.0 / setting->sample_rate_hz, 4, index, &value[1]);
}

static const probe_t looked_for = {.group = "rate",
                                   .explanation = "The loop gets wider with the rate of the drive, minor loops too.",
                                   .excitation = "the same amplitude at three frequencies",
                                   .parts = PROBE_FAST_TRIANGLE | PROBE_CHIRPS | PROBE_BURST,
                                   .probe = probe,
                                   .searched = 3U,
                                   .accuracy = {0.1}};

const block_t block_rate_dependent_hysteresis = {.name = "rate_dependent_hysteresis",
                                                 .place = PLACE_HYSTERESIS,
                                                 .modifies_hysteresis = true,
                                                 .widens_plays = true,
                                                 .text = "play thresholds that grow with the drive rate",
                                                 .parameter = parameters,
                                                 .parameters = 3,
                                                 .state_bytes = sizeof(state_t),
                                                 .open = open,
                                                 .settle = settle,
                                                 .step = step,
                                                 .compile = compile,
                                                 .probe = &looked_for};
