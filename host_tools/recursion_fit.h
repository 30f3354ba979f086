/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Identification of a hysteresis with the recursion of paper 001 behind it (recursion.h), from one sinusoidal
 * recording.
 *
 * All numbers but the feedback c1..c3, the bilinear gain and what shapes the hysteresis enter linearly. Two estimates:
 *
 *   one step     the measured last positions stand on the right side of the recursion, and everything is one linear
 *                problem. The recursive least squares of the paper, begun at 0 with the covariance that the ridge of
 *                least_squares.h stands for and without forgetting, ends at this very solution.
 *   simulation   the model's own last positions stand there. For given feedback, gain and shape the position is linear
 *                in the rest, with columns that have gone through the recursion; feedback, gain and shape are searched
 *                with a simplex. The inverse in the amplifier and `hyst simulate` run the model this way.
 */
#ifndef RECURSION_FIT_H
#define RECURSION_FIT_H

#include "family.h"
#include "recursion.h"
#include "sine_fit.h"

/** Columns that the hysteresis contributes at most. */
#define RECURSION_FIT_COLUMNS 512
/** Numbers that shape a hysteresis at most. */
#define RECURSION_FIT_SHAPES 4

/** A hysteresis as a sum of columns with weights to be found. */
typedef struct {
    size_t columns;                           /**< the first one is the drive */
    const double *lower;                      /**< of their weights, in the simulation estimate; -HUGE_VAL: none */
    size_t shapes;                            /**< numbers that the columns depend on */
    double shape_start[RECURSION_FIT_SHAPES]; /**< in the search's own, unbounded scale */
    /** At rest, with these shapes (in the search's scale). */
    void (*open)(void *state, const double *shape);
    /** One sample: fills the columns. */
    void (*step)(void *state, double u, double *column);
    void *state;
} recursion_basis_t;

typedef struct {
    const recording_t *recording;
    sine_t drive;    /**< its phase belongs to sample 0 */
    size_t from, to; /**< samples that count; those before let the memory of the start die away */
    recursion_basis_t basis;
    bool bilinear; /**< whether g is looked for; 0 otherwise */
    /** Keeps the simulation estimate invertible: weights at their lower bounds or above, a part of them for the drive,
     * harmonics that the inverse bears. Otherwise everything may have any sign and size, as in the paper. */
    bool invertible;
    progress_t *progress;
} recursion_problem_t;

typedef struct {
    double feedback[RECURSION_FEEDBACK], bilinear;
    double harmonic[RECURSION_HARMONICS], offset_um;
    double shape[RECURSION_FIT_SHAPES];
    double weight[RECURSION_FIT_COLUMNS];
    double one_step_rms_um;  /**< with the measured last positions */
    double simulated_rms_um; /**< with its own; HUGE_VAL: the simulation runs away */
} recursion_estimate_t;

/**
 * Finds the sine of the job's only recording and the samples that count: from a third of the training part or 3000 on,
 * but not within the first period, and at most 6000 or two periods of them. Fails on several recordings, on a drive
 * that is no sine, and on less than two periods. basis and bilinear are the caller's to fill in.
 */
bool recursion_problem(const family_job_t *job, const char *family, recursion_problem_t *problem, failure_t *failure);

/** Shapes as they start. */
bool recursion_fit_one_step(const recursion_problem_t *problem, recursion_estimate_t *estimate, failure_t *failure);
/** Starts at the one-step estimate, at the best of some modes with a lag, and, with a bilinear gain, at the best
 * without it. */
bool recursion_fit_simulation(const recursion_problem_t *problem, recursion_estimate_t *estimate, failure_t *failure);

/** Sets the parameters of recursion.h in a block. */
void recursion_set(model_block_t *block, const recursion_problem_t *problem, const recursion_estimate_t *estimate);

/** What both estimates reach: notes, and facts "simulated_rms_um", "one_step_rms_um", "least_squares_one_step_rms_um",
 * "least_squares_simulated_rms_um" (absent: runs away) of the model. */
void recursion_report(model_t *model, family_notes_t *notes, const recursion_estimate_t *one_step,
                      const recursion_estimate_t *estimate);

#endif
