/* SPDX-License-Identifier: GPL-3.0-or-later */
/* One mode of the mechanics: y'' + 2 zeta omega y' + omega^2 y = omega^2 u, gain 1 at rest. */
#include "chain/catalogue.h"
#include "compile/compile_job.h"
#include "elements/oscillator.h"

static const parameter_info_t parameters[] = {
    {.name = "frequency_hz", .unit = "Hz", .low = 1e-3, .high = 1e9, .text = "undamped natural frequency"},
    {.name = "damping_ratio", .unit = "1", .low = 1e-5, .high = 0.999, .text = "of critical damping"}};

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

/* What rings, and the maximum of the response, whose width says little of the damping where the drive has few lines. */
static bool from_look(const probe_seen_t *seen, size_t index, double *value) {
    if (seen->rings > 0 && index == 0) {
        value[0] = seen->ring_hz;
        value[1] = seen->ring_damping;
        return true;
    }
    index -= seen->rings > 0 ? 1 : 0;
    value[0] = seen->peak_hz;
    value[1] = index == 0 ? 0.01 : 0.1;
    return seen->peak_hz > 0.0 && index < 2;
}

static bool rings(const probe_seen_t *seen, const double *value) {
    return probe_saw_ring(seen, value[0]);
}

static const probe_t looked_for = {
    .group = "resonance",
    .explanation =
        "The mechanics ring: a gain that grows towards one frequency, and oscillation at it after every edge.",
    .excitation = "a chirp through the mode, or edges",
    .parts = PROBE_FAST_TRIANGLE | PROBE_CHIRPS,
    .probe = probe,
    .from_look = from_look,
    .rings = rings,
    .searched = 3U,
    .accuracy = {0.001, 0.04},
    .most = {0.0, 0.2}};

const block_t block_resonance = {.name = "resonance",
                                 .place = PLACE_MECHANICS,
                                 .order = 10,
                                 .text = "inertia and damping: one mode of the mechanics",
                                 .smooths = true,
                                 .parameter = parameters,
                                 .parameters = 2,
                                 .state_bytes = sizeof(oscillator_stage_t),
                                 .open = oscillator_stage_open,
                                 .settle = oscillator_stage_settle,
                                 .step = oscillator_stage_step,
                                 .compile = compile,
                                 .probe = &looked_for};
