/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Waveforms that the amplifier plays, and how they become what its source plays: a sine, or a table of breakpoints.
 *
 *     sine        cycles of offset + amplitude sin(2 pi f t)
 *     triangle    cycle k of n swings amplitude * (n - k + 1) / n to both sides, at the same frequency: one major loop
 *                 and the minor loops inside it; from offset to offset
 *     staircase   from offset - amplitude up in equal steps to offset + amplitude and down again, once a cycle; a step
 *                 takes a fifth of its time to rise, then holds
 *
 * Levels are in the unit of what is played: V (record) or um (track).
 */
#ifndef WAVEFORM_H
#define WAVEFORM_H

#include "base/failure.h"
#include <stdint.h>

typedef enum { WAVEFORM_SINE, WAVEFORM_TRIANGLE, WAVEFORM_STAIRCASE } waveform_kind_t;

typedef struct {
    waveform_kind_t kind;
    double frequency_hz;
    double amplitude, offset;
    unsigned long cycles;
    unsigned long steps; /**< of a staircase, one way */
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
} waveform_options_t;

#define WAVEFORM_OPTIONS_DEFAULT                                                                                       \
    { .name = NULL, .frequency_hz = 1.0, .amplitude = (double)NAN, .offset = (double)NAN, .cycles = 3, .steps = 10 }

/**
 * Makes the waveform of the options within [low, high], the range that can be played; `unit` is that of the range, for
 * messages, which call the options by their names on the command line. Fails with an unknown name, nothing to play, or
 * levels outside of the range.
 */
bool waveform_make(const waveform_options_t *options, const double range[2], const char *unit, waveform_t *waveform,
                   failure_t *failure);

/** The name as the option takes it. */
const char *waveform_name(waveform_kind_t kind);

/** Where it starts: the level that holds before the first sample. */
double waveform_start(const waveform_t *waveform);

/** Length of the whole waveform in samples of the amplifier. */
double waveform_samples(const waveform_t *waveform, double sample_rate_hz);

/**
 * The corners of a triangle (all cycles) or a staircase (one cycle, to be played `cycles` times), at times rounded to
 * whole samples without drift. Returns their number, at most WAVEFORM_MAX_BREAKPOINTS.
 */
size_t waveform_breakpoints(const waveform_t *waveform, double sample_rate_hz,
                            breakpoint_t corners[WAVEFORM_MAX_BREAKPOINTS]);

#endif
