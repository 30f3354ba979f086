/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Loops that widen with the drive rate: every threshold, and half the distance of every relay's two drives, grows
 * alike,
 *
 *     growth = min(beta_s |du/dt|, limit_v)
 *
 * This is equivalent to a play of that half width before the hysteresis, except for elements without width
 * (docs/MODELS.md, section 3.7). The play is simulated here, and its lag behind the drive is passed to the hysteresis
 * in slack_v.
 *
 * In the amplifier's form, lib/hyst (prandtl_ishlinskii.h), the rate at sample k is known before sample k, so that the
 * inverse is exact:
 *
 *     growth[k] = min(beta_s |v[k-1]| / dt, limit_v)
 *     v[k] = v[k-1] + g (u[k] - u[k-1] - v[k-1]),     g = 1 - exp(-dt / rate_filter_s)
 *
 * An actuator has no such delay: with `immediate` the rate is the present one, from a parabola through the samples.
 */
#include "chain/catalogue.h"
#include "compile/compile_job.h"
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
     .text = "largest growth; the amplifier's is half its drive range less its largest threshold"},
    {.name = "immediate",
     .unit = "1",
     .low = 0.0,
     .high = 1.0,
     .optional = true,
     .chosen = true,
     .text = "1: by the rate of the instant, as an actuator; 0: of the sample before, as the amplifier"}};

enum { BETA, RATE_FILTER, LIMIT, IMMEDIATE, PARAMETERS };

/* Instants per sample at which an immediate growth is evaluated. */
enum { INSTANTS = 8 };
/* V per sample: a filtered rate that a hold has brought below that is none. It would go on into numbers so small that
 * arithmetic takes a hundred times as long. */
static const double at_rest = 1e-30;

typedef struct {
    bool immediate;
    double beta_samples, rate_gain, limit_v; /* rate_gain: of a sample, or of an instant */
    double input, rate;                      /* V, V per sample */
    double change, bend;                     /* of the drive in the last sample, and of that */
    double behind;                           /* the play */
} state_t;

static bool check(const parameter_t *parameter, failure_t *failure) {
    const double immediate = parameter[IMMEDIATE].value[0];
    return immediate == 0.0 || immediate == 1.0 || fail(failure, "immediate = %g is neither 0 nor 1", immediate);
}

/* Of a first-order low pass. */
static double gain_of(double filter_s, double rate_hz) {
    return filter_s > 0.0 ? -expm1(-1.0 / (filter_s * rate_hz)) : 1.0;
}

static void open(void *memory, const parameter_t *parameter, const stage_setup_t *setup) {
    state_t *state = memory;
    state->immediate = parameter[IMMEDIATE].value[0] != 0.0;
    state->beta_samples = parameter[BETA].value[0] * setup->sample_rate_hz;
    state->rate_gain =
        gain_of(parameter[RATE_FILTER].value[0], setup->sample_rate_hz * (state->immediate ? INSTANTS : 1));
    state->limit_v = parameter[LIMIT].value[0];
}

static void settle(void *memory, signal_t *signal) {
    state_t *state = memory;
    state->input = state->behind = signal->value;
    state->rate = state->change = state->bend = 0.0;
    signal->slack_v = 0.0;
}

/* fmin() and fmax() are calls, too slow for the innermost loop. No value here is a NaN. */
static double clamp(double low, double value, double high) {
    return value < low ? low : value > high ? high : value;
}

static double growth_of(const state_t *state, double rate) {
    const double growth_v = state->beta_samples * fabs(rate);
    return growth_v < state->limit_v ? growth_v : state->limit_v;
}

static void follow(state_t *state, double drive_v) {
    const double growth_v = growth_of(state, state->rate);
    state->behind = clamp(drive_v - growth_v, state->behind, drive_v + growth_v);
}

/* Curvature of the drive through a sample: the smaller of two successive second differences, or 0 where their signs
 * differ, as at a corner. It is limited so that the rate at most reaches 0 at one end of the sample, as where a hold
 * begins. */
static double smooth_bend(double before, double now, double change) {
    const double smaller = fabs(before) < fabs(now) ? fabs(before) : fabs(now);
    const double most = smaller < 2.0 * fabs(change) ? smaller : 2.0 * fabs(change);
    return before * now > 0.0 ? copysign(most, now) : 0.0;
}

static void follow_through_sample(state_t *state, double drive_v) {
    const double input = state->input, change = drive_v - input, bend = change - state->change;
    const double smooth = smooth_bend(state->bend, bend, change), gain = state->rate_gain;
    double rate = state->rate, behind = state->behind;
    state->change = change;
    state->bend = bend;
    if (change == 0.0 && fabs(rate) < at_rest) {
        state->rate = 0.0;
        state->behind = drive_v;
        return;
    }
    /* An unsmoothed rate changes right after a corner, before the drive has moved. */
    for (int i = gain < 1.0 ? 1 : 0; i <= INSTANTS; i++) {
        const double part = (double)i / INSTANTS;
        const double drive = input + change * part - 0.5 * smooth * part * (1.0 - part);
        rate += gain * (change + smooth * (part - 0.5) - rate);
        const double growth_v = growth_of(state, rate);
        behind = clamp(drive - growth_v, behind, drive + growth_v);
    }
    state->rate = rate;
    state->behind = behind;
}

static void step(void *memory, signal_t *signal) {
    state_t *state = memory;
    if (state->immediate) {
        follow_through_sample(state, signal->value);
    } else {
        follow(state, signal->value);
        state->rate += state->rate_gain * (signal->value - state->input - state->rate);
    }
    state->input = signal->value;
    signal->slack_v = signal->value - state->behind;
}

/* Largest part of a branch's slope that the growth acts on, (S_j - S_0) / S_j; 1 at most where no weight is negative.
 */
static double widening_part(const model_t *model) {
    const model_block_t *bank = model_find(model, block_prandtl_ishlinskii.name);
    double slope = 0.0, part = 0.0;
    if (bank == NULL) {
        return 1.0;
    }
    const parameter_t *weights = model_parameter(bank, "weights");
    for (size_t i = 0; i < weights->count; i++) {
        slope += weights->value[i];
        part = slope > 0.0 ? fmax(part, (slope - weights->value[0]) / slope) : part;
    }
    return part;
}

/* The past drive sets the thresholds in the amplifier. This is the least time constant with which that feedback is
 * stable (docs/MODELS.md, section 3.4). The amplifier accepts 0.9. */
static double stable_filter_s(double beta_s, double filter_s, double part, double rate_hz) {
    const double most = 0.8;
    return beta_s * rate_hz * part * gain_of(filter_s, rate_hz) <= most ? filter_s : beta_s * part / most;
}

static bool compile(compile_job_t *job, const parameter_t *parameter) {
    hyst_parameters_t *p = job->parameters;
    const double beta_s = parameter[BETA].value[0];
    double filter_s = parameter[RATE_FILTER].value[0];
    if (model_find(job->model, block_preisach.name) != NULL) {
        compile_uncorrected(job, "the amplifier widens banks of plays, not planes of relays; its loops are those of a "
                                 "slow drive, and what the actuator's widen by stays in the position");
        return true;
    }
    if (parameter[IMMEDIATE].value[0] != 0.0) {
        filter_s = stable_filter_s(beta_s, filter_s, widening_part(job->model), job->rate_hz);
        compile_note(job,
                     "%s: the amplifier's thresholds grow one sample later than the model's, by a rate smoothed "
                     "over %.3g ms (model: %.3g ms)",
                     job->block, 1e3 * filter_s, 1e3 * parameter[RATE_FILTER].value[0]);
    } else {
        compile_note(job, "%s: the amplifier's thresholds grow as the model's", job->block);
    }
    return compile_to_fixed(job, beta_s * job->rate_hz, 20, "beta in samples", &p->pi_beta) &&
           compile_to_fixed(job, gain_of(filter_s, job->rate_hz), 30, "rate gain", &p->pi_rate_gain);
}

/* Longer smoothing no longer gives a rate: thresholds that shrink long after a motion let the position drift, as creep
 * does. */
#define LONGEST_FILTER_S 0.02

static bool probe(const probe_setting_t *setting, size_t index, double *value) {
    /* Thresholds grow by 5 % of half the range at the largest rate. */
    value[BETA] = 0.025 * (setting->drive_high_v - setting->drive_low_v) / setting->largest_rate_v_per_s;
    value[LIMIT] = HUGE_VAL;
    value[IMMEDIATE] = 1.0;
    const bool there = index == 0 || probe_between(4.0 / setting->sample_rate_hz, 16.0 / setting->sample_rate_hz, 2,
                                                   index - 1, &value[RATE_FILTER]);
    value[RATE_FILTER] = fmin(value[RATE_FILTER], LONGEST_FILTER_S);
    return there;
}

static const probe_t looked_for = {.group = "rate",
                                   .explanation = "The loop gets wider with the rate of the drive, minor loops too.",
                                   .excitation = "the same amplitude at three frequencies",
                                   .parts = PROBE_FAST_TRIANGLE | PROBE_CHIRPS | PROBE_BURST,
                                   .probe = probe,
                                   .searched = 1U << BETA | 1U << RATE_FILTER,
                                   .most = {[RATE_FILTER] = LONGEST_FILTER_S},
                                   .accuracy = {0.04}};

const block_t block_rate_dependent_hysteresis = {.name = "rate_dependent_hysteresis",
                                                 .place = PLACE_HYSTERESIS,
                                                 .order = 20,
                                                 .modifies_hysteresis = true,
                                                 .widens = true,
                                                 .text = "loops that widen with the drive rate",
                                                 .parameter = parameters,
                                                 .parameters = PARAMETERS,
                                                 .check = check,
                                                 .state_bytes = sizeof(state_t),
                                                 .open = open,
                                                 .settle = settle,
                                                 .step = step,
                                                 .compile = compile,
                                                 .probe = &looked_for};
