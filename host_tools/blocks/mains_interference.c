/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Hum: a sine on the reading, also at rest, whose phase does not depend on the drive. */
#include "chain/catalogue.h"
#include <gsl/gsl_math.h>

enum { FREQUENCY, AMPLITUDE, PHASE };

static const parameter_info_t parameters[] = {
    {.name = "frequency_hz", .unit = "Hz", .low = 0.0, .high = 1e6, .text = "of the mains, or a multiple of it"},
    {.name = "amplitude_um",
     .proportional = true,
     .unit = "um",
     .low = 0.0,
     .high = 1e6,
     .text = "half of peak to peak"},
    {.name = "phase_rad",
     .unit = "rad",
     .low = -2.0 * M_PI,
     .high = 2.0 * M_PI,
     .optional = true,
     .text = "of the sine when the recording begins; of several, the first"}};

/* A vector that turns by the same angle at each sample. Each turn rounds it, so it is made anew every so often: it
 * stays within 1e-13 of the sine (tests/host/test_effects.c). */
enum { MADE_ANEW = 256 };

typedef struct {
    double turns_per_sample, amplitude_um, phase_rad;
    double turn_cos, turn_sin; /* of a sample's angle */
    double x, y;               /* the vector; y is the hum */
    uint64_t samples;          /* since the recording began */
} state_t;

static void open(void *memory, const parameter_t *parameter, const stage_setup_t *setup) {
    state_t *state = memory;
    state->turns_per_sample = parameter[FREQUENCY].value[0] / setup->sample_rate_hz;
    state->amplitude_um = parameter[AMPLITUDE].value[0];
    state->phase_rad =
        parameter[PHASE].value[0] + 2.0 * M_PI * remainder(parameter[FREQUENCY].value[0] * setup->clock_s, 1.0);
    state->turn_cos = cos(2.0 * M_PI * remainder(state->turns_per_sample, 1.0));
    state->turn_sin = sin(2.0 * M_PI * remainder(state->turns_per_sample, 1.0));
}

static void settle(void *memory, signal_t *signal) {
    (void)signal;
    ((state_t *)memory)->samples = 0;
}

static void make_anew(state_t *state) {
    const double samples = (double)state->samples, all = state->turns_per_sample * samples;
    const double turns = fmod(all, 1.0) + fma(state->turns_per_sample, samples, -all); /* with what `all` has lost */
    const double angle = 2.0 * M_PI * turns + state->phase_rad;
    state->x = state->amplitude_um * cos(angle);
    state->y = state->amplitude_um * sin(angle);
}

static void step(void *memory, signal_t *signal) {
    state_t *state = memory;
    if (state->samples % MADE_ANEW == 0) {
        make_anew(state);
    }
    state->samples++;
    signal->value += state->y;
    const double x = state->x * state->turn_cos - state->y * state->turn_sin;
    state->y = state->x * state->turn_sin + state->y * state->turn_cos;
    state->x = x;
}

/* Slower lines are not electrical. */
static const double slowest_hz = 5.0;

static bool probe(const probe_setting_t *setting, size_t index, double *value) {
    static const double mains_hz[] = {50.0, 60.0, 100.0, 120.0, 150.0, 180.0};
    const size_t known = sizeof mains_hz / sizeof mains_hz[0], place = index / 4;
    value[AMPLITUDE] = 1e-3 * (setting->displacement_high_um - setting->displacement_low_um);
    value[PHASE] = 0.5 * M_PI * (double)(index % 4); /* no amplitude is negative */
    if (place >= known + setting->lines) {
        return false;
    }
    value[FREQUENCY] = place < known ? mains_hz[place] : fmax(slowest_hz, setting->line_hz[place - known]);
    return true;
}

static const probe_t looked_for = {
    .group = "hum",
    .explanation = "A line at one frequency that does not follow the drive and is there at rest too.",
    .excitation = "silence; the same drive at another speed: the line stays where it is",
    .parts = PROBE_SILENCE | PROBE_FAST_TRIANGLE,
    .probe = probe,
    .searched = 7U,
    .accuracy = {1e-05}};

const block_t block_mains_interference = {
    .name = "mains_interference",
    .place = PLACE_SENSOR,
    .order = 40,
    .adds = true,
    .text = "hum of the mains on the reading",
    .own_clock = true,
    .parameter = parameters,
    .parameters = 3,
    .state_bytes = sizeof(state_t),
    .open = open,
    .settle = settle,
    .step = step,
    .uncorrected = "it is on the reading, with a phase that the amplifier does not know; the position does not have it",
    .probe = &looked_for};
