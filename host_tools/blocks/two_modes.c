/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Two modes of the mechanics, as a sum over modes: each takes its share of the static stroke. docs/MODELS.md,
 * section 4.1. */
#include "chain/catalogue.h"
#include "compile/compile_job.h"
#include "elements/oscillator.h"

enum { LOWER_HZ, LOWER_DAMPING, UPPER_HZ, UPPER_DAMPING, UPPER_SHARE, PARAMETERS };

static const parameter_info_t parameters[] = {
    {.name = "lower_hz", .unit = "Hz", .low = 1e-3, .high = 1e9, .text = "undamped natural frequency of one mode"},
    {.name = "lower_damping", .unit = "1", .low = 1e-5, .high = 0.999, .text = "its damping, of critical damping"},
    {.name = "upper_hz", .unit = "Hz", .low = 1e-3, .high = 1e9, .text = "of the other mode, which is faster"},
    {.name = "upper_damping", .unit = "1", .low = 1e-5, .high = 0.999, .text = "its damping, of critical damping"},
    {.name = "upper_share",
     .unit = "1",
     .low = -1.0,
     .high = 2.0,
     .text = "part of the static stroke that is the faster mode's; the other has the rest of 1"}};

typedef struct {
    oscillator_stage_t lower, upper;
    double upper_share;
} state_t;

static bool check(const parameter_t *parameter, failure_t *failure) {
    return parameter[UPPER_HZ].value[0] > parameter[LOWER_HZ].value[0] ||
           fail(failure, "upper_hz must be greater than lower_hz");
}

static void open(void *memory, const parameter_t *parameter, const stage_setup_t *setup) {
    state_t *state = memory;
    oscillator_stage_open(&state->lower, parameter + LOWER_HZ, setup);
    oscillator_stage_open(&state->upper, parameter + UPPER_HZ, setup);
    state->upper_share = parameter[UPPER_SHARE].value[0];
}

/* Both see the same input. */
static void share(state_t *state, signal_t *signal, void (*run)(void *stage, signal_t *signal)) {
    signal_t upper = *signal;
    run(&state->lower, signal);
    run(&state->upper, &upper);
    signal->value += state->upper_share * (upper.value - signal->value);
}

static void settle(void *memory, signal_t *signal) {
    share(memory, signal, oscillator_stage_settle);
}

static void step(void *memory, signal_t *signal) {
    share(memory, signal, oscillator_stage_step);
}

static bool compile(compile_job_t *job, const parameter_t *parameter) {
    const oscillation_t lower = {parameter[LOWER_HZ].value[0], parameter[LOWER_DAMPING].value[0]};
    const oscillation_t upper = {parameter[UPPER_HZ].value[0], parameter[UPPER_DAMPING].value[0]};
    inverse_filter_t inverse[2];
    if (!invert_two_modes(lower, upper, parameter[UPPER_SHARE].value[0], job->rate_hz, job->options->no_filters,
                          inverse)) {
        compile_uncorrected(
            job, "its antiresonance or a mode is above a fifth of the sample rate, or has no stable inverse; "
                 "of that only the delay is compensated");
    }
    return compile_shape(job, inverse[0]) && compile_shape(job, inverse[1]);
}

/* The mode that was found, and another one of a small share: where the residual has lines, and everywhere within a
 * decade. Nothing was found: two in a ratio, which the search moves. */
static bool probe(const probe_setting_t *setting, size_t index, double *value) {
    static const struct { double damping, part; } forms[] = {{0.02, 0.1}, {0.02, -0.1}, {0.1, 0.1}, {0.1, -0.1}};
    enum { FORMS = sizeof forms / sizeof forms[0], FREQUENCIES = 20 };
    static const double ratio = 2.5, most_ratio = 10.0;
    const bool found = setting->replaced != NULL;
    const double damping = forms[index % FORMS].damping, part = forms[index % FORMS].part;
    const double highest_hz = setting->sample_rate_hz / 2.2;
    double own[2] = {0.0, 0.02}, other_hz;
    index /= FORMS;
    if (found) {
        own[0] = setting->replaced_value[0];
        own[1] = setting->replaced_value[1];
        if (index < setting->lines) {
            other_hz = setting->line_hz[index];
        } else if (!probe_between(fmin(own[0] * most_ratio, highest_hz), own[0] / most_ratio, FREQUENCIES,
                                  index - setting->lines, &other_hz)) {
            return false;
        }
    } else if (!probe_between(highest_hz / ratio, 4.0 / setting->longest_s, FREQUENCIES, index, &own[0])) {
        return false;
    } else {
        other_hz = ratio * own[0];
    }
    const bool other_is_upper = other_hz >= own[0];
    value[LOWER_HZ] = other_is_upper ? own[0] : other_hz;
    value[LOWER_DAMPING] = other_is_upper ? own[1] : damping;
    value[UPPER_HZ] = fmax(other_is_upper ? other_hz : own[0], 1.001 * value[LOWER_HZ]);
    value[UPPER_DAMPING] = other_is_upper ? damping : own[1];
    value[UPPER_SHARE] = other_is_upper ? part : 1.0 - part;
    return true;
}

static bool rings(const probe_seen_t *seen, const double *value) {
    return probe_saw_ring(seen, value[LOWER_HZ]) || probe_saw_ring(seen, value[UPPER_HZ]);
}

static const probe_t looked_for = {
    .group = "resonance",
    .in_place_of = {"resonance"},
    .extends = true,
    .extends_by = UPPER_SHARE,
    .explanation =
        "The mechanics ring at two frequencies: a second mode stands beside the first, with an antiresonance "
        "between them where both move against each other.",
    .excitation = "a chirp through both modes, or edges",
    .parts = PROBE_FAST_TRIANGLE | PROBE_CHIRPS,
    .probe = probe,
    .rings = rings,
    .searched = (1U << PARAMETERS) - 1U,
    .accuracy = {0.001, 0.04, 0.001, 0.04, 0.02},
    .most = {0.0, 0.2, 0.0, 0.2}};

const block_t block_two_modes = {.name = "two_modes",
                                 .place = PLACE_MECHANICS,
                                 .order = 15,
                                 .text = "inertia and damping: two modes of the mechanics, with their shares",
                                 .smooths = true,
                                 .parameter = parameters,
                                 .parameters = PARAMETERS,
                                 .check = check,
                                 .state_bytes = sizeof(state_t),
                                 .open = open,
                                 .settle = settle,
                                 .step = step,
                                 .compile = compile,
                                 .probe = &looked_for};
