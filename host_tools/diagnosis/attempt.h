/* SPDX-License-Identifier: GPL-3.0-or-later */
/** One attempt of a diagnosis: the whole search from one chain on. */
#ifndef ATTEMPT_H
#define ATTEMPT_H

#include "base/progress.h"
#include "belief/rivals.h"
#include "diagnosis/diagnose.h"
#include "diagnosis/evidence/joint_fit.h"
#include "diagnosis/noise/lines.h"

typedef struct {
    diagnosis_t *diagnosis;
    failure_t *failure;
    probe_setting_t setting;
    double line_hz[LINES_MOST];
    const block_t *without;        /* not looked for */
    const model_t *begin;          /* what the search begins with in place of the fitted chain; NULL: that */
    joint_power_t power;           /* of the model as it is */
    double found_um;               /* what all that was found changes, whitened, beyond the nuisance subspace */
    double step_um, step_sigma_um; /* of the converter, 0: none to be seen */
    bool coarse;                   /* the steps' error is larger than the noise */
    fitted_chain_t beside; /* review.h: the operator in the place of the hysteresis, nothing found; may be empty */
    progress_t progress;
    double left; /* of the work, by a guess: how many rounds it takes is unknown */
} attempt_t;

/** Moves the progress on. */
void attempt_advance(attempt_t *job);

/**
 * 1. Fits the chain's hysteresis, and what else of it the recordings determine (refitted.h).
 * 2. From there, or from job->begin, finds block after block (search_round.h).
 * 3. Settles which of them stay (reconsider.h), their names (names.h) and their sides (sides.h).
 * 4. Judges what remains (verdict.h).
 *
 * Fills the job's diagnosis, whose samples and noise are known, and its power.
 */
bool attempt_from(attempt_t *job, const model_t *given);

/** The same with one finding, which is not looked for: a block with the numbers that it has beside the universal
 * operator. Only the hysteresis is fitted to it. */
bool attempt_with(attempt_t *job, const model_t *given, const suspect_t *heard);

/** NRMSE of a model over the samples that are fitted, and held out; beyond what an unknown past left (past.h). */
bool attempt_measure(const attempt_t *job, const model_t *model, double *percent, double *held_out_percent);

/** The blocks of the model that the baseline does not have, as bits. */
unsigned attempt_blocks_found(const diagnosis_t *d, const model_t *model);
/** And those of the given chain that are fitted again. */
unsigned attempt_blocks_fitted(const diagnosis_t *d, const model_t *model);

/** Of a fit of all that was found. One that settles ends by itself; one that was stopped before leaves what is then
 * taken for another effect. */
enum { ATTEMPT_ITERATIONS = 16 };

/** What is left of the held-out samples (a sum of squares) beyond the noise, in parts of it. */
double attempt_excess(const diagnosis_t *d, double held);

/** Takes noise and sensor steps out of a chain: they are no response to a drive, and the search goes without them. */
void attempt_without_noise(model_t *model);

#endif
