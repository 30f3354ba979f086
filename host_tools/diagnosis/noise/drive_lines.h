/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Frequencies that a drive has itself: what stands there in a residual may be what a hysteresis of another shape
 * leaves. */
#ifndef DRIVE_LINES_H
#define DRIVE_LINES_H

#include <stdbool.h>
#include <stddef.h>

/** Whether a drive has a line at this frequency, or nearer to it than 2 over its duration: a peak of its spectrum
 * (lines.h); or, of one that repeats itself or turns at regular times, a multiple of its frequency. */
bool drive_has_line(const double *drive, size_t samples, double sample_rate_hz, double hz);

#endif
