/* SPDX-License-Identifier: GPL-3.0-or-later */
/* No physical effect: a periodic term on the reading (tone.h), any frequency with its second and third harmonic, for a
 * tone that hum does not describe. */
#include "chain/catalogue.h"
#include "elements/tone.h"

enum { HARMONICS = 3, FREQUENCY = 0, FIRST = 1, PARAMETERS = FIRST + 2 * HARMONICS };

static const parameter_info_t parameters[PARAMETERS] = {
    {.name = "frequency_hz", .unit = "Hz", .low = 1e-3, .high = 1e6, .text = "of the period"},
    TONE_PART(cos, 1, proportional, "cosine of the frequency itself; the recording begins at angle 0"),
    TONE_PART(sin, 1, proportional, "its sine"),
    TONE_PART(cos, 2, proportional, "cosine of the second harmonic"),
    TONE_PART(sin, 2, proportional, "its sine"),
    TONE_PART(cos, 3, proportional, "cosine of the third harmonic"),
    TONE_PART(sin, 3, proportional, "its sine")};

static void open(void *memory, const parameter_t *parameter, const stage_setup_t *setup) {
    double part[2 * HARMONICS];
    for (size_t i = 0; i < 2 * HARMONICS; i++) {
        part[i] = parameter[FIRST + i].value[0];
    }
    tone_open(memory, parameter[FREQUENCY].value[0], setup->sample_rate_hz, setup->clock_s, HARMONICS, part);
}

static void settle(void *memory, signal_t *signal) {
    (void)signal;
    tone_settle(memory);
}

static void step(void *memory, signal_t *signal) {
    signal->value += tone_next(memory);
}

/* Where the residual has lines, which are this harmonic; it is linear in all but the frequency. */
static bool probe(const probe_setting_t *setting, size_t index, double *value) {
    const size_t harmonic = setting->harmonic > 0 ? setting->harmonic : 1;
    if (index / 2 >= setting->lines || harmonic > HARMONICS) {
        return false;
    }
    for (size_t i = 0; i < 2 * HARMONICS; i++) {
        value[FIRST + i] = 0.0;
    }
    value[FREQUENCY] = setting->line_hz[index / 2] / (double)harmonic;
    value[FIRST + 2 * (harmonic - 1) + index % 2] =
        1e-3 * (setting->displacement_high_um - setting->displacement_low_um);
    return true;
}

static const probe_t fitted = {
    .explanation = "No known effect fits. This periodic term, which does not follow the drive, describes it, without a "
                   "cause.",
    .excitation = "silence; the same drive at another speed: what does not follow it stays where it is",
    .probe = probe,
    .searched = (1U << PARAMETERS) - 1U};

const block_t block_empirical_tone = {
    .name = "empirical_tone",
    .place = PLACE_SENSOR,
    .order = 120,
    .adds = true,
    .own_clock = true,
    .text = "no physical effect: a tone on the reading with harmonics, of any frequency",
    .parameter = parameters,
    .parameters = PARAMETERS,
    .state_bytes = sizeof(tone_t),
    .open = open,
    .settle = settle,
    .step = step,
    .uncorrected = "it is on the reading, with a phase that the amplifier does not know",
    .empirical = &fitted};
