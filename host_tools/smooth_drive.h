/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * What a signal does between its samples: where it is smooth the cubic through four of them, where it has a corner a
 * straight line. (Lines alone take amplitude from fast drives and make them late, by which a delay, a low pass and a
 * mode would be taken for each other; cubics alone swing about corners.)
 */
#ifndef SMOOTH_DRIVE_H
#define SMOOTH_DRIVE_H

#include "block.h"

/**
 * How smooth the signal is between the inner two of six samples in a row, the newest first: the part of the cubic in
 * what is drawn between them, 0 (the line) to 1, without a jump, which a fit could not cross. It is 1 where the second
 * differences at both and at a third one, on either side, are alike (two alone are a flat top between two lines), or
 * where the four of them lie on a line, as about an inflection. x[0]
 * is known if known_ahead is 2, x[1] if it is 1. Without the next sample it is the line: a cubic through samples on one
 * side alone would swing beyond the end of a step, and a hysteresis remembers that.
 */
double smooth_drive(const double x[6], size_t known_ahead);

/** The samples about the interval from the last sample, x[3], to this one, x[2], and how smooth the signal is there. */
typedef struct {
    double x[6], smooth;
    size_t known_ahead;      /**< as the last sample had it; what is known ahead has to come then */
    double bend[4], like[3]; /**< its second differences, and how alike they are: what the next sample keeps of them */
} drive_window_t;

/** As if that had been there for ever. */
void drive_window_settle(drive_window_t *window, double value);
/** The next sample comes in. */
void drive_window_next(drive_window_t *window, const signal_t *signal);
/** Whether what is drawn between the last sample and this one goes beyond both, and how far. */
bool drive_window_turns(const drive_window_t *window, double *turn);

#endif
