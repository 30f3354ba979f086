/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * When recordings began, by the clock of a line that runs freely.
 *
 * Hum has one frequency and one amplitude in all recordings of a question, and in each its own phase, since
 * recordings are not started by the mains. So the phase of a line in each recording says how far a common clock was
 * when it began.
 */
#ifndef LINE_CLOCK_H
#define LINE_CLOCK_H

#include "diagnosis/noise/samples.h"

/**
 * Sets clock_s of these recordings, which are the samples', 0 to a period, 0 for the first one. residual: a column;
 * only samples that are fitted are looked at. Of the lines the first one counts that is within 1 % of a multiple of 50
 * or 60 Hz, or else the first one. Without lines nothing is done.
 */
void line_clock_set(recording_t *recordings, const samples_t *samples, const double *residual, const double *line_hz,
                    size_t lines);

#endif
