/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Interpolation of a signal between its samples: a cubic through four of them where it is smooth, a straight line at a
 * corner, or held (stage_setup_t.held). Lines alone attenuate and delay fast drives, so that a delay, a low pass and a
 * mode could be confused. Cubics alone overshoot at corners.
 */
#ifndef SMOOTH_DRIVE_H
#define SMOOTH_DRIVE_H

#include "chain/block.h"

/**
 * How smooth the signal is between the inner two of six samples in a row, the newest first: the weight of the cubic in
 * the interpolant, from 0 (the line) to 1. It is continuous, because a fit cannot cross a jump. It is 1 in two cases.
 * In the first the second differences at both and at a third one, on either side, are similar; two alone may be a flat
 * top between two lines. In the second the four of them lie on a line, as at an inflection. x[0] is known if
 * known_ahead is 2, x[1] if it is 1. Without the next sample it is the line: a one-sided cubic would overshoot the end
 * of a step, and a hysteresis remembers that.
 */
double smooth_drive(const double x[6], size_t known_ahead);

/** Weights of x[1] .. x[4] in the cubic at `fraction` (0 to 1) of the way from x[2] back to x[3]. */
void smooth_drive_weights(double fraction, double weight[4]);
/** The value there: the cubic as far as the signal is smooth, else the line. */
double smooth_drive_value(const double x[6], size_t known_ahead, double fraction, const double weight[4]);

/** A held input `delay` samples later: the value is that of the sample *whole ago, held since the returned part of a
 * sample (stage_setup_t.held_since). */
double held_later(double held_since, double delay, double *whole);

/** The samples about the interval from the last sample, x[3], to this one, x[2], and how smooth the signal is there. */
typedef struct {
    double x[6], smooth;
    size_t known_ahead;      /**< known_ahead of the last sample; the samples it promised must follow */
    double bend[4], like[3]; /**< second differences and their similarity, reused at the next sample */
} drive_window_t;

/** Steady state at a constant value. */
void drive_window_settle(drive_window_t *window, double value);
/** Takes the next sample. */
void drive_window_next(drive_window_t *window, const signal_t *signal);
/** The same for drive_window_turns alone: `smooth` is not worked out. */
void drive_window_shift(drive_window_t *window, const signal_t *signal);
/** Whether the interpolant between the last sample and this one goes beyond both, and how far. */
bool drive_window_turns(const drive_window_t *window, double *turn);

#endif
