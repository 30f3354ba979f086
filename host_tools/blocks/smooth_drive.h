/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * What a signal does between its samples: where it is smooth the cubic through four of them, where it has a corner a
 * straight line. (Lines alone take amplitude from fast drives and make them late, by which a delay, a low pass and a
 * mode would be taken for each other; cubics alone swing about corners.)
 */
#ifndef SMOOTH_DRIVE_H
#define SMOOTH_DRIVE_H

#include <stdbool.h>

/** Whether five samples in a row, the newest first, have no corner: their second differences are nearly the same, and
 * the newest goes on as the others did. (Where a rounded step ends it does not, and a cubic would swing beyond the end:
 * a hysteresis remembers that.) */
bool smooth_drive(const double x[5]);

#endif
