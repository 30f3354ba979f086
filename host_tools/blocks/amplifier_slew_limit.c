/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * A voltage that follows the drive no faster than the limit: what a current limit makes of a constant capacitance.
 *
 * With d = voltage - drive and a drive that is a ramp of slope s between samples, d falls towards 0 at the rate limit
 * +- s and stays there while |s| is within the limit. Solved exactly, corner inside the sample included. Towards a
 * drive that is held it goes at the limit, until it is there.
 */
#include "chain/catalogue.h"
#include "compile/compile_job.h"
#include <math.h>

static const parameter_info_t parameters[] = {
    {.name = "limit_v_per_s", .unit = "V/s", .low = 1e-9, .high = 1e12, .text = "largest rate of the voltage"}};

typedef struct {
    double limit; /* V per sample */
    double drive, voltage;
    bool held;
    double held_since;
} state_t;

static void open(void *memory, const parameter_t *parameter, const stage_setup_t *setup) {
    state_t *state = memory;
    state->limit = parameter[0].value[0] / setup->sample_rate_hz;
    state->held = setup->held;
    state->held_since = setup->held_since;
}

static void settle(void *memory, signal_t *signal) {
    state_t *state = memory;
    state->drive = signal->value;
    state->voltage = signal->value;
}

/* For so many samples. */
static void go_towards(state_t *state, double drive, double samples) {
    const double way = drive - state->voltage;
    state->voltage += copysign(fmin(fabs(way), samples * state->limit), way);
}

static void step_held(state_t *state, signal_t *signal) {
    const double before = state->voltage;
    go_towards(state, state->drive, 1.0 - state->held_since);
    const double between = state->voltage;
    go_towards(state, signal->value, state->held_since);
    state->drive = signal->value;
    signal->value = state->voltage;
    signal_turns(signal, before, between);
}

static void step_ramp(state_t *state, signal_t *signal) {
    const double slope = signal->value - state->drive, excess = fmax(0.0, fabs(slope) - state->limit);
    const double difference = state->voltage - state->drive, gap = fabs(difference);
    const double before = state->voltage;
    double met = before;
    const double closing = state->limit + (difference > 0.0 ? slope : -slope); /* rate at which the gap closes */
    if (gap > 0.0 && gap >= closing) {                                         /* not within this sample */
        state->voltage -= copysign(state->limit, difference);
    } else { /* from where they meet on, only the excess opens a new gap */
        met = gap > 0.0 ? state->drive + slope * gap / closing : before;
        const double after = gap > 0.0 ? 1.0 - gap / closing : 1.0;
        state->voltage = signal->value - copysign(after * excess, slope);
    }
    state->drive = signal->value;
    signal->value = state->voltage;
    signal_turns(signal, before, met);
}

static void step(void *memory, signal_t *signal) {
    state_t *state = memory;
    if (state->held) {
        step_held(state, signal);
    } else {
        step_ramp(state, signal);
    }
}

static bool compile(compile_job_t *job, const parameter_t *parameter) {
    compile_uncorrected(
        job, "no drive makes the voltage faster; it does no harm while the drive moves by less than %.4g V/s",
        parameter[0].value[0]);
    return true;
}

/* Just below the largest rate it acts in few samples, and more of it grows fast: close together there. A drive that was
 * rounded goes by up to a step faster from one sample to the next, and a limit there smooths the rounding alone, which
 * makes readings likelier: so the largest rate is that of two steps less. */
static bool probe(const probe_setting_t *setting, size_t index, double *value) {
    static const double part[] = {0.97, 0.93, 0.87, 0.75, 0.51, 0.29, 0.16, 0.09, 0.05};
    const double rounding_v_per_s = 2.0 * setting->seen.drive_step_v * setting->sample_rate_hz;
    const double largest_v_per_s = setting->largest_rate_v_per_s - rounding_v_per_s;
    if (index >= sizeof part / sizeof part[0] || largest_v_per_s <= 0.0) {
        return false;
    }
    value[0] = part[index] * largest_v_per_s;
    return true;
}

static const probe_t looked_for = {.group = "slew",
                                   .explanation = "The voltage cannot change faster than a limit: fast large drives "
                                                  "become triangles, slow or small ones do not suffer.",
                                   .excitation =
                                       "the same frequency at two amplitudes, one above and one below the limit",
                                   .parts = PROBE_FAST_TRIANGLE | PROBE_CHIRPS | PROBE_BURST,
                                   .probe = probe,
                                   .searched = 1U,
                                   .corners = true,
                                   .accuracy = {0.005}};

const block_t block_amplifier_slew_limit = {.name = "amplifier_slew_limit",
                                            .place = PLACE_ELECTRONICS,
                                            .order = 30,
                                            .text = "largest rate of the voltage: slew or current limit",
                                            .smooths = true,
                                            .parameter = parameters,
                                            .parameters = 1,
                                            .state_bytes = sizeof(state_t),
                                            .open = open,
                                            .settle = settle,
                                            .step = step,
                                            .compile = compile,
                                            .probe = &looked_for};
