/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Whether a drive repeats itself, and how often. */
#ifndef DRIVE_PERIOD_H
#define DRIVE_PERIOD_H

#include <stddef.h>

/**
 * The period in samples, a fraction included; 0 unless the whole drive repeats itself at least three times. Two periods
 * may differ by 1/500 of the variance (mean square), and by what half a sample of shift makes. Where a period has so
 * few samples that this is much, it may be a multiple that is found.
 */
double drive_period(const double *drive, size_t samples);

#endif
