/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Frequencies that a drive has itself: what stands there in a residual may be what a hysteresis of another shape
 * leaves. */
#ifndef DRIVE_LINES_H
#define DRIVE_LINES_H

#include "recording/recording.h"

/** Whether the drive of samples [from, to) has a line at this frequency, or nearer to it than 2 over their duration.
 * That is a peak of its spectrum (lines.h), or a multiple of its frequency where it repeats itself or turns at regular
 * times. */
bool drive_has_line(const recording_t *recording, size_t from, size_t to, double hz);

#endif
