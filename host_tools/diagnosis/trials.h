/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Several attempts at the same question, of which the best one stands. */
#ifndef TRIALS_H
#define TRIALS_H

#include "diagnosis/attempt.h"
#include "diagnosis/baseline.h"

enum { TRIALS_MOST_SHAPES = 1 + BASELINE_SHAPES };

/** The search from the first shape, or a given chain. Fills the job's diagnosis, whose samples and noise are known, and
 * its power. */
bool trial_of_first(attempt_t *job, const baseline_t *first);
/** Whether that leaves so little that no other shape is tried. */
bool trial_leaves_nothing(const attempt_t *job, const baseline_t *first);
/** From those of the others that may do better. baseline[0] was the first one. */
void trials_of_others(attempt_t *job, const baseline_t *baseline, size_t shapes);
/** Puts a shape into a chain, in the place of its hysteresis. */
void baseline_put_into(baseline_t *shape, const model_t *chain);
/** A chain with the hysteresis of another one; to be freed. */
void chain_with_hysteresis_of(const model_t *from, const model_t *chain, model_t *model);

/**
 * What two blocks do, a third may seem to do alone, and then hides them. Where a hysteresis of few numbers did not lead
 * to the whole answer, the search is made once more without the block that came first.
 */
void trial_without_the_first(attempt_t *job);

/**
 * Where more than noise is left, a block is worth much beside the universal operator, and nothing like it was found, it
 * may be the answer. It has to make the position more likely, beside the operator, than what was found does. And it has
 * to lower the error of the held-out samples beside a hysteresis of few numbers.
 */
void trial_of_heard(attempt_t *job);

/**
 * Where much more than noise is left, and no shape of hysteresis explains it, the search is made once more from the
 * bank that is best beside one strong effect (contest.h), in this chain (NULL: alone). That answer stands if it leaves
 * less than contest_worth of the power, held out.
 */
void trial_of_contest(attempt_t *job, const model_t *chain);

#endif
