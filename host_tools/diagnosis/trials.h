/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Several attempts at the same question, of which the best one stands. */
#ifndef TRIALS_H
#define TRIALS_H

#include "attempt.h"
#include "baseline.h"

/**
 * The search from the first shape; and, where that is not the whole answer, from those of the others that may do
 * better. Fills the job's diagnosis, whose samples and noise are known, and its power.
 */
bool trials_of_shapes(attempt_t *job, const baseline_t *baseline, size_t shapes);

/**
 * What two blocks do, a third may seem to do alone, and then hides them. Where a hysteresis of few numbers did not lead
 * to the whole answer, the search is made once more without the block that came first.
 */
void trial_without_the_first(attempt_t *job);

#endif
