/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Several attempts at the same question, of which the best one stands. */
#ifndef TRIALS_H
#define TRIALS_H

#include "diagnosis/answer/state.h"
#include "diagnosis/question/baseline.h"

enum { TRIALS_MOST_SHAPES = 1 + BASELINE_SHAPES };

/** The search from the first shape, or a given chain. The answer is that one's. */
bool trial_of_first(state_t *state, const baseline_t *first);
/** Whether that leaves so little that no other shape is tried. */
bool trial_leaves_nothing(const state_t *state, const baseline_t *first);
/** From those of the others that may do better. baseline[0] was the first one. */
void trials_of_others(state_t *state, const baseline_t *baseline, size_t shapes);
/** Puts a shape into a chain, in the place of its hysteresis. */
void baseline_put_into(baseline_t *shape, const model_t *chain);
/** A chain with the hysteresis of another one; to be freed. */
void chain_with_hysteresis_of(const model_t *from, const model_t *chain, model_t *model);

/**
 * Where nothing was found, and an operator of any shape leaves clearly less than the answer: its hysteresis was fitted
 * beside what has since been taken out. Each of the shapes is fitted alone, and the one that leaves clearly less of the
 * held-out samples takes its place.
 */
bool trial_of_shapes_alone(state_t *state, const baseline_t *baseline, size_t shapes);

/**
 * What two blocks do, a third may seem to do alone, and then hides them. Where a hysteresis of few numbers did not lead
 * to the whole answer, the search is made once more without the block that came first.
 */
void trial_without_the_first(state_t *state);

/**
 * A richer form of a group may be the only one that explains anything, and then no finding of the group is there in
 * whose place it could be tried. Where structure is left, the search is made once more with the one that promises most
 * beside what was found. It stands only if it is found, and nothing is left but noise or another shape of the
 * hysteresis.
 */
void trial_of_richer(state_t *state);

/**
 * Where more than noise is left, and blocks speak beside the universal operator (heard.h), these may be the answer.
 * They have to make the position more likely, beside the operator, than what was found does, or the held-out samples
 * have to be missed by clearly less. And the operator has to leave only noise with them, or a hysteresis of few numbers
 * less of the held-out samples than without.
 */
void trial_of_heard(state_t *state);

/**
 * Where much more than noise is left, and no shape of hysteresis explains it, the search is made once more. It begins
 * with the blocks that win a contest (contest.h), and the bank that is best beside them, in this chain (NULL: alone).
 * That answer stands if it leaves less than contest_worth of the power, held out; its question is then another one,
 * with other samples held out (question_share_ends). Without a chain the other shapes are then tried in the bank's
 * place, with the winners beside them from the beginning.
 */
void trial_of_contest(state_t *state, const model_t *chain, const baseline_t *baseline, size_t shapes);

#endif
