/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * How the lag of the position behind its reference changes over time.
 *
 * Against the reference p, a lag of L samples leaves -L p'. In short windows j the sums A_j = -sum e p' and
 * B_j = sum p'^2 hold all that can be said about L(t); slow changes of offset and gain are taken out of e before. For a
 * course L(t) with free size a beside a constant, a = sum A Lc / sum B Lc^2 (Lc: L less its mean, weighted with B). Its
 * error is that of the residual, from sums over whole passes of a repeated drive (over windows of another one), widened
 * by their autocorrelation time. An error of the reference that comes and goes with the drive then does not count as
 * independent in each window.
 *
 * Courses: a step, at each window; a saw tooth, of each rate up to one tooth in eight windows and 16 phases; a ramp.
 */
#ifndef LOOK_LAGS_H
#define LOOK_LAGS_H

#include "look/path/reference.h"

enum { LAGS_MOST_STEPS = 6 };

typedef struct {
    size_t count;                    /**< windows; 0: too little motion */
    double *at_s, *product, *square; /**< A and B */
    size_t *from;                    /**< first sample of each window; count + 1 */
    size_t batches;                  /**< of windows, for errors: passes, or each window is one */
    size_t *batch;                   /**< of each window */
} lags_t;

typedef struct {
    size_t steps;
    size_t at[LAGS_MOST_STEPS]; /**< window at which each begins, in order of time */
    double size[LAGS_MOST_STEPS], sigma[LAGS_MOST_STEPS];
    double log_chance; /**< of the least of them; all places counted */
    double left;       /**< chi square of what they leave */
} lag_steps_t;

typedef struct {
    double teeth_per_s, phase; /**< L = size (x - round x), x = teeth_per_s t + phase; ramp: teeth 0, L = size t */
    double size, sigma;        /**< samples; of a ramp: samples a second */
    double log_chance;
    double left;
    double by_wave; /**< of what a saw tooth takes away: the part that a sine of about its rate takes, which has as many
                       numbers and no jump */
} lag_course_t;

void lags_make(const recording_t *recording, const drive_look_t *drive, const reference_t *reference, lags_t *lags);
void lags_free(lags_t *lags);

/** Steps one after the other, each one with the others fitted again, as long as each has a chance below the
 * limit. */
void lags_steps(const lags_t *lags, double log_chance_limit, lag_steps_t *steps);
void lags_saw(const lags_t *lags, lag_course_t *saw);
void lags_ramp(const lags_t *lags, lag_course_t *ramp);

#endif
