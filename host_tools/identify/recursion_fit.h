/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Identification of a hysteresis followed by the recursion of paper 001 (recursion.h), from one sinusoidal recording.
 *
 * All parameters are linear except the feedback c1..c3, the bilinear gain and the shape of the hysteresis. There are
 * two estimates:
 *
 *     one step     The regressors are the measured last positions, so the problem is linear. Recursive least squares as
 *                  in the paper, without forgetting and with an initial covariance equal to the ridge of
 *                  least_squares.h, gives exactly this solution.
 *     simulation   The regressors are the model's last positions. For given feedback, gain and shape the position is
 *                  linear in the other parameters, with columns filtered by the recursion. A simplex searches for
 *                  feedback, gain and shape. The inverse in the amplifier and `hyst simulate` run the model this way.
 */
#ifndef RECURSION_FIT_H
#define RECURSION_FIT_H

#include "identify/family.h"
#include "identify/recursion_problem.h"

/**
 * Finds the sine of the job's only recording and the samples included: from a third of the training part or 3000 on,
 * after the first period, and at most 6000 or two periods of them. Fails on several recordings, on a drive that is not
 * a sine, and on less than two periods. The caller fills in basis and bilinear.
 */
bool recursion_problem(const family_job_t *job, const char *family, recursion_problem_t *problem, failure_t *failure);

/** Shapes as they start. */
bool recursion_fit_one_step(const recursion_problem_t *problem, recursion_estimate_t *estimate, failure_t *failure);
/** Starts at the one-step estimate, at the best of some modes with a lag, and, with a bilinear gain, at the best
 * without it. */
bool recursion_fit_simulation(const recursion_problem_t *problem, recursion_estimate_t *estimate, failure_t *failure);

/** Sets the parameters of recursion.h in a block. */
void recursion_set(model_block_t *block, const recursion_problem_t *problem, const recursion_estimate_t *estimate);

/** Errors of both estimates: notes, and facts "simulated_rms_um", "one_step_rms_um", "least_squares_one_step_rms_um",
 * "least_squares_simulated_rms_um" (absent: it diverges) of the model. */
void recursion_report(model_t *model, family_notes_t *notes, const recursion_estimate_t *one_step,
                      const recursion_estimate_t *estimate);

#endif
