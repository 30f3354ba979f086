/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * A chain of blocks in which the universal operator stands in the place of the hysteresis.
 *
 * What a block changes of the position is then known without a model of the hysteresis. The drive passes through the
 * blocks before the operator, the operator with its weights as they are, and the blocks behind it.
 */
#ifndef BELIEF_IMITATION_H
#define BELIEF_IMITATION_H

#include "chain/model.h"
#include "operator/hysteresis.h"
#include "recording/recording.h"

typedef struct {
    const recording_t *recordings;
    size_t count, all;      /**< recordings; samples of them all, one after the other, as in each column */
    model_t chain;          /**< with a play bank without plays in the place of the hysteresis */
    double *level_v;        /**< columns: what arrives at the hysteresis */
    double *slack_v;        /**< by how much its loops are widened */
    operator_path_t *paths; /**< of these, one a recording */
    double *predicted_um;   /**< a column: the operator's position, where there is one */
    double *simulated_um;   /**< a column: behind all blocks */
} imitation_t;

/** An empty chain, into which blocks can be put; to be freed. */
void imitation_chain(double sample_rate_hz, model_t *chain);

/** Takes a copy of the chain and runs the drive up to the hysteresis. The recordings must outlive it. To be closed;
 * nothing is there if it fails. */
bool imitation_open(imitation_t *imitation, const model_t *chain, const recording_t *recordings, size_t count,
                    failure_t *failure);
void imitation_close(imitation_t *imitation);

/** As imitation_run, with an operator that stays at 0. */
bool imitation_rest(imitation_t *imitation, failure_t *failure);

/** Runs the operator along the paths, and its position through the blocks behind it. */
bool imitation_run(imitation_t *imitation, const hysteresis_t *hysteresis, failure_t *failure);

/**
 * What the blocks behind the operator do to small changes of its position, as a linear filter of few states. What they
 * do beyond that (curves, sources, changes with time) is left out, and a filter that would come out wrong changes
 * nothing at all.
 */
void imitation_behind(const imitation_t *imitation, state_space_t *behind);

/**
 * The position of another chain, with one block more or with other numbers, with the same operator: a column. `at`: the
 * block that differs. false if it cannot be simulated, or is not finite.
 */
bool imitation_altered(const imitation_t *imitation, const hysteresis_t *hysteresis, const model_t *chain, size_t at,
                       double *position_um);

#endif
