/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Recordings of the twin of paper 002, and what the thesis reads off its loops. */
#ifndef SEED_002_LOOPS_H
#define SEED_002_LOOPS_H

#include "recording/recording.h"
#include <stdint.h>

/** Periods of a recorded sine. */
#define LOOPS_002_CYCLES 6

/** A sine from 0 V to top_v and back. The twin has been at it without end. */
recording_t record_sine_002(double hz, double rate_hz, double top_v, uint64_t seed);

/** The same, from rest at 0 V on. */
recording_t record_from_rest_002(double hz, double rate_hz, double top_v, size_t periods, uint64_t seed);

/** First-order reversal curves: up from 0 V, which is where all relays are down, to a lower peak each time and down, a
 * period each; three times over. */
recording_t record_reversals_002(double hz, double rate_hz, double top_v, uint64_t seed);

/** Peak to peak. */
double stroke_002(const double *displacement, size_t samples);

/** A straight line, and deviations from it in % of the stroke. */
typedef struct {
    double slope, intercept, maximum, mean;
} line_002_t;

/** Of least squares. */
line_002_t straight_line_002(const double *drive, const double *displacement, size_t samples);

/** "clockwise" or "counterclockwise": which way a loop of one period turns, from the integral of y du. */
const char *direction_002(const double *drive, const double *position, size_t period);

#endif
