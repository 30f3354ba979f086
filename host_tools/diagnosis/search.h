/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Looking for one missing block: every candidate of the catalogue against the evidence. */
#ifndef SEARCH_H
#define SEARCH_H

#include "evidence.h"

/** A candidate at its best. */
typedef struct {
    const block_t *block;
    model_t model;        /**< the baseline with the block in its place, its searched parameters at their best */
    size_t at;            /**< index of the block in the model */
    double *signature;    /**< of the block at its best; NULL, with likelihood 0, if it cannot be simulated there */
    evidence_test_t test; /**< of that signature: amplitude near 1 */
    bool settled;         /**< another round of refinement gains nothing */
    double likelihood;    /**< 2 log of the likelihood ratio to the baseline: what it explains, in units of the noise */
} candidate_t;

typedef struct {
    size_t tested; /**< signatures that were tried: the size of the family of tests */
    size_t count;  /**< candidates, best first */
    candidate_t *candidate;
} search_t;

/**
 * Tries the candidates that a hysteresis of another shape can imitate (shapes), or those that it cannot. The ones that
 * explain most are refined. Blocks that the baseline has are not tried again.
 */
void search(const evidence_t *evidence, const model_t *baseline, const probe_setting_t *setting, bool shapes,
            search_t *found);
void search_free(search_t *found);

/**
 * The block's searched parameters once more, in a model that has the block already and is the evidence's baseline. Each
 * search of evidence takes the model's own numbers for small changes; a large effect needs this afterwards.
 */
void polish(const evidence_t *evidence, model_t *model, const block_t *block);

/** Where a block goes in a chain: behind the last block of its place or an earlier one. */
size_t place_in_chain(const model_t *model, const block_t *block);

#endif
