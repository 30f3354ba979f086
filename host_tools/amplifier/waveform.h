/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Waveforms that the amplifier plays, and how they become what its source plays: a sine, a sweep, a multisine, or a
 * table of breakpoints.
 *
 *     sine        cycles of offset + amplitude sin(2 pi f t)
 *     triangle    cycle k of n swings amplitude * (n - k + 1) / n to both sides, at the same frequency: one major loop
 *                 and the minor loops inside it; from offset to offset
 *     staircase   from offset - amplitude up in equal steps to offset + amplitude and down again, once a cycle; a step
 *                 takes a fifth of its time to rise, then holds
 *     sweep       a sine from offset on whose frequency goes to end_frequency_hz in sweep_s, once a cycle
 *     multisine   cycles of the sum of up to 16 tones of one amplitude, at odd multiples of the frequency that are
 *                 spread evenly, by their logarithms, up to end_frequency_hz; the amplitude is that of the whole
 *
 * Levels are in the unit of what is played: V (record) or um (track).
 */
#ifndef WAVEFORM_H
#define WAVEFORM_H

#include "base/failure.h"
#include "motion/source.h"
#include <stdint.h>

typedef enum {
    WAVEFORM_SINE,
    WAVEFORM_TRIANGLE,
    WAVEFORM_STAIRCASE,
    WAVEFORM_SWEEP,
    WAVEFORM_MULTISINE
} waveform_kind_t;

/** Where a waveform may be named: "sine|triangle|..". */
#define WAVEFORM_NAMES "sine|triangle|staircase|sweep|multisine"

typedef struct {
    uint32_t harmonic;
    double amplitude;   /**< 1 is that of the multisine */
    double phase_turns; /**< 0 .. 1 */
} waveform_tone_t;

typedef struct {
    waveform_kind_t kind;
    double frequency_hz;
    double amplitude, offset;
    unsigned long cycles;
    unsigned long steps;     /**< of a staircase, one way */
    double end_frequency_hz; /**< of a sweep, and of the highest tone of a multisine */
    double sweep_s;          /**< of a sweep */
    bool linear;             /**< sweep: by equal steps of the frequency; else by equal factors */
    size_t tones;            /**< of a multisine */
    waveform_tone_t tone[SOURCE_TONES_MAX];
} waveform_t;

/** A corner of a polygon, `samples` after the corner before. */
typedef struct {
    uint32_t samples;
    double level;
} breakpoint_t;

/** Most breakpoints that any waveform needs. */
#define WAVEFORM_MAX_BREAKPOINTS 128

typedef struct {
    const char *name;
    double frequency_hz;
    double amplitude; /**< NAN: as much of the range as is safe */
    double offset;    /**< NAN: middle of the range */
    unsigned long cycles, steps;
    double end_frequency_hz, sweep_s;
    bool linear;
    unsigned long tones; /**< fewer where there are not as many odd harmonics */
} waveform_options_t;

#define WAVEFORM_OPTIONS_DEFAULT                                                                                       \
    {                                                                                                                  \
        .name = NULL, .frequency_hz = 1.0, .amplitude = (double)NAN, .offset = (double)NAN, .cycles = 3, .steps = 10,  \
        .end_frequency_hz = 100.0, .sweep_s = 10.0, .linear = false, .tones = SOURCE_TONES_MAX                         \
    }

/**
 * Makes the waveform of the options within [low, high], the range that can be played; `unit` is that of the range, for
 * messages, which call the options by their names on the command line. Fails with an unknown name, nothing to play, or
 * levels outside of the range.
 */
bool waveform_make(const waveform_options_t *options, const double range[2], const char *unit, waveform_t *waveform,
                   failure_t *failure);

/** The name as the option takes it. */
const char *waveform_name(waveform_kind_t kind);

/** "3 cycles at 1 Hz", and for a sweep or a multisine what it goes through. */
void waveform_describe(const waveform_t *waveform, char text[120]);

/** Where it starts: the level that holds before the first sample. */
double waveform_start(const waveform_t *waveform);

/** Length of the whole waveform in samples of the amplifier; of sweeps without the rest of the last turn of each, which
 * the amplifier completes. */
double waveform_samples(const waveform_t *waveform, double sample_rate_hz);

/** The lowest frequency of a triangle or a staircase: each line of it has at most 2^32 - 1 samples. 0 of others. */
double waveform_lowest_hz(const waveform_t *waveform, double sample_rate_hz);

/**
 * The corners of a triangle (all cycles) or a staircase (one cycle, to be played `cycles` times), at times rounded to
 * whole samples without drift. The frequency is at least waveform_lowest_hz. Returns their number, at most
 * WAVEFORM_MAX_BREAKPOINTS.
 */
size_t waveform_breakpoints(const waveform_t *waveform, double sample_rate_hz,
                            breakpoint_t corners[WAVEFORM_MAX_BREAKPOINTS]);

#endif
