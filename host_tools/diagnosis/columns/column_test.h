/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Whether what a model leaves goes with a column of numbers that the model knows nothing of.
 *
 *     e' = coefficient x' + rest,     e', x': residual and column, whitened (noise.h), less their projections on
 *                                     the nuisance subspace (nuisance.h)
 *
 * In the *fast* test also less those on 12 half waves of cosine over each recording: what passes it cannot be any other
 * slow drift. It is fitted to the samples that are not held out, and passes when
 *
 * - the coefficient is larger than chance makes it, by a standard error that does not take neighbours for independent
 *   (regression.h);
 * - what it explains is at least 0.08 of the noise, as for a block (candidate.h), and a tenth of what the model's
 * findings change: their simulation is right to about that;
 * - 2 log likelihood of the held-out samples at this coefficient, the nuisance subspace and half waves free, is at
 * least 12.
 */
#ifndef COLUMN_TEST_H
#define COLUMN_TEST_H

#include "diagnosis/answer/answer.h"
#include "numerics/regression.h"

typedef struct column_test column_test_t;

typedef enum { TEST_SLOW_TOO, TEST_FAST } column_speed_t;

typedef struct {
    double coefficient, sigma; /**< um per unit of the column */
    double least;      /**< coefficient from which on it would have passed; HUGE_VAL: the column does not vary */
    double likelihood; /**< 2 log, of the fitted samples */
    double share;      /**< of the square of e' on the held-out samples that it explains */
    bool passed;
} column_trial_t;

/**
 * chance: of one false alarm in one trial. model: the diagnosis' baseline, or what became of it with all findings. NULL
 * when it cannot be simulated.
 */
column_test_t *column_test_open(const answer_t *answer, const model_t *model, double chance, failure_t *failure);
void column_test_close(column_test_t *test);
/** The model without noise and steps, and its simulation: a column. */
const model_t *column_test_model(const column_test_t *test);
const double *column_test_simulated(const column_test_t *test);
/** Whether there are enough held-out samples for the nuisance subspace. Otherwise nothing passes. */
bool column_test_enough(const column_test_t *test);

column_trial_t column_try(column_test_t *test, const double *column, column_speed_t speed);

/** Part of what the half waves explain beyond the nuisance subspace that the column explains, too. */
double column_drift_share(column_test_t *test, const double *column);

/**
 * What a column leaves of a signature that is in the model: the signature's coefficient where the residual, with the
 * signature in it, is fitted by both. 1: all of it stands beside the column; 0: the column explains it.
 */
regression_t column_beside(column_test_t *test, const double *signature, const double *column);

#endif
