/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * What a signal does between its samples: where it is smooth the cubic through four of them, where it has a corner a
 * straight line. (Lines alone take amplitude from fast drives and make them late, by which a delay, a low pass and a
 * mode would be taken for each other; cubics alone swing about corners.)
 */
#ifndef SMOOTH_DRIVE_H
#define SMOOTH_DRIVE_H

/** How smooth the signal is between the inner two of four samples in a row: the part of the cubic in what is drawn
 * between them, 0 (the line) to 1. It is 1 where the second differences at both are nearly the same, and goes to 0
 * without a jump: a fit could not cross one. (A cubic through samples on one side alone would swing beyond the end of a
 * step, and a hysteresis remembers that: without the next sample it is the line.) */
double smooth_drive(const double x[4]);

#endif
