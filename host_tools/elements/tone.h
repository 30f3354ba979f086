/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * A periodic term of a frequency and its harmonics, which runs by the clock and not by any signal. With p = 2 pi f t,
 *
 *     sum of cosine_h cos(h p) + sine_h sin(h p),     h = 1 .. harmonics
 *
 * Harmonics from the second on are left out from half of the sample rate on.
 */
#ifndef TONE_H
#define TONE_H

#include <stddef.h>
#include <stdint.h>

enum { TONE_MOST_HARMONICS = 5 };

typedef struct {
    size_t harmonics;                     /**< up to the last one that is there */
    double part[2 * TONE_MOST_HARMONICS]; /**< cosine, sine of each */
    double turns_per_sample, turns;       /**< of p; turns: at the first sample */
    double turn_cos, turn_sin;            /**< of a sample's angle */
    double now_cos, now_sin;              /**< of p */
    uint64_t samples;                     /**< since the recording began */
} tone_t;

/** A row of a block's table: the cosine or sine of a harmonic, in um. trait: a flag of parameter_info_t that it has. */
#define TONE_PART(wave, number, trait, its_text)                                                                       \
    { .name = #wave "_" #number "_um", .trait = true, .unit = "um", .low = -1e6, .high = 1e6, .text = (its_text) }

/** clock_s: when the recording begins (stage_setup_t.clock_s). part: cosine, sine of each harmonic. */
void tone_open(tone_t *tone, double frequency_hz, double sample_rate_hz, double clock_s, size_t harmonics,
               const double *part);
/** Back to the first sample. */
void tone_settle(tone_t *tone);
/** The term at this sample. */
double tone_next(tone_t *tone);

#endif
