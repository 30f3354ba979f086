/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Hum on the reading, also at rest, whose phase does not depend on the drive. With p = 2 pi f t,
 *
 *     reading = position + amplitude sin(p + phase) + sum of cos_h cos(h p) + sin_h sin(h p),     h = 2 .. 5
 *
 * A rectifier's hum is no sine. What it has beside its first line is looked for once that was found.
 */
#include "chain/catalogue.h"
#include "elements/tone.h"
#include <gsl/gsl_math.h>

enum {
    FREQUENCY,
    AMPLITUDE,
    PHASE,
    FIRST_HARMONIC, /* cosine and sine of the second one, and so on */
    PARAMETERS = FIRST_HARMONIC + 2 * (TONE_MOST_HARMONICS - 1)
};

static const parameter_info_t parameters[PARAMETERS] = {
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
     .text = "of the sine when the recording begins; of several, the first"},
    TONE_PART(cos, 2, optional, "cosine of the second harmonic; p is 0 when the first recording begins"),
    TONE_PART(sin, 2, optional, "its sine"),
    TONE_PART(cos, 3, optional, "cosine of the third harmonic"),
    TONE_PART(sin, 3, optional, "its sine"),
    TONE_PART(cos, 4, optional, "cosine of the fourth harmonic"),
    TONE_PART(sin, 4, optional, "its sine"),
    TONE_PART(cos, 5, optional, "cosine of the fifth harmonic"),
    TONE_PART(sin, 5, optional, "its sine")};

static void open(void *memory, const parameter_t *parameter, const stage_setup_t *setup) {
    const double amplitude_um = parameter[AMPLITUDE].value[0], phase_rad = parameter[PHASE].value[0];
    double part[2 * TONE_MOST_HARMONICS] = {amplitude_um * sin(phase_rad), amplitude_um * cos(phase_rad)};
    for (size_t p = FIRST_HARMONIC; p < PARAMETERS; p++) {
        part[2 + p - FIRST_HARMONIC] = parameter[p].value[0];
    }
    tone_open(memory, parameter[FREQUENCY].value[0], setup->sample_rate_hz, setup->clock_s, TONE_MOST_HARMONICS, part);
}

static void settle(void *memory, signal_t *signal) {
    (void)signal;
    tone_settle(memory);
}

static void step(void *memory, signal_t *signal) {
    signal->value += tone_next(memory);
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

static double join(const probe_setting_t *setting, const double *value, size_t parameter) {
    (void)setting;
    (void)parameter;
    return 0.1 * value[AMPLITUDE];
}

static const probe_t looked_for = {
    .group = "hum",
    .explanation =
        "A line at one frequency, often with multiples of it, that does not follow the drive and is there at "
        "rest too.",
    .excitation = "silence; the same drive at another speed: the line stays where it is",
    .parts = PROBE_SILENCE | PROBE_FAST_TRIANGLE,
    .probe = probe,
    .searched = 1U << FREQUENCY | 1U << AMPLITUDE | 1U << PHASE,
    .joins = (1U << PARAMETERS) - (1U << FIRST_HARMONIC),
    .join = join,
    .accuracy = {1e-05}};

const block_t block_mains_interference = {
    .name = "mains_interference",
    .place = PLACE_SENSOR,
    .order = 40,
    .adds = true,
    .text = "hum of the mains on the reading, with harmonics",
    .own_clock = true,
    .parameter = parameters,
    .parameters = PARAMETERS,
    .state_bytes = sizeof(tone_t),
    .open = open,
    .settle = settle,
    .step = step,
    .uncorrected = "it is on the reading, with a phase that the amplifier does not know; the position does not have it",
    .probe = &looked_for};
