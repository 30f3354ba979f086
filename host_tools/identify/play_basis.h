/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Outputs of the play operators for the drive of a recording: the regressors of the linear fit.
 */
#ifndef PLAY_BASIS_H
#define PLAY_BASIS_H

#include "chain/block.h"
#include "recording/recording.h"

typedef struct {
    size_t operators;
    double *threshold_v; /**< rising, > 0 */
    bool rate_dependent; /**< the next three are used; meanings as in block rate_dependent_hysteresis */
    double beta_s, rate_filter_s, limit_v;
} play_basis_t;

/** Runs a basis along a recording, sample by sample. */
typedef struct {
    const play_basis_t *basis;
    const double *drive;
    size_t next;      /**< sample that play_walk_step goes to */
    double *memory_v; /**< of the operators after the last step */
    void *growth_state;
} play_walk_t;

/**
 * Starts before the first sample. initial_v are the operators' memories; NULL: demagnetised at 0 V. They need not be
 * reachable: the first step brings them within their thresholds of the first drive.
 */
void play_walk_begin(play_walk_t *walk, const play_basis_t *basis, const recording_t *recording,
                     const double *initial_v);
/** One sample: walk->memory_v are then the outputs of the operators. */
void play_walk_step(play_walk_t *walk);
void play_walk_end(play_walk_t *walk);

/** First sample from which on no operator depends on the initial memory any more; `end` if there is none before it. */
size_t play_memory_determined(const play_basis_t *basis, const recording_t *recording, size_t end);

/**
 * The same for a drive that may be too small to move every operator: the first sample from which on all operators that
 * are determined before `end` are so. The others, with larger thresholds, keep their initial memory.
 */
size_t play_memory_as_determined_as_possible(const play_basis_t *basis, const recording_t *recording, size_t end);

#endif
