/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * What a signal does between its samples: where it is smooth the cubic through four of them, where it has a corner a
 * straight line. (Lines alone take amplitude from fast drives and make them late, by which a delay, a low pass and a
 * mode would be taken for each other; cubics alone swing about corners.)
 */
#ifndef SMOOTH_DRIVE_H
#define SMOOTH_DRIVE_H

#include <stdbool.h>

/** Whether the signal is smooth between the inner two of four samples in a row: its second differences there are nearly
 * the same. (A cubic through samples on one side alone would swing beyond the end of a step, and a hysteresis remembers
 * that: without the next sample it is the line.) */
bool smooth_drive(const double x[4]);

#endif
