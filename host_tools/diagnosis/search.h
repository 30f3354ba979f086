/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Looking for one missing block: every candidate of the catalogue against the evidence. */
#ifndef SEARCH_H
#define SEARCH_H

#include "evidence.h"
#include "joint_fit.h"

/** A candidate at its best. */
typedef struct {
    const block_t *block;
    model_t model;        /**< the baseline with the block in its place, its searched parameters at their best */
    size_t at;            /**< index of the block in the model */
    double *signature;    /**< of the block at its best beside the baseline's hysteresis; NULL, with likelihood 0, if it
                             cannot    be simulated there */
    evidence_test_t test; /**< of that signature: amplitude near 1 */
    double likelihood;    /**< 2 log of the likelihood ratio to the baseline, beyond J */
    bool joint;           /**< the model was fitted again together with its hysteresis */
    joint_power_t power;  /**< what is left then */
    double electrical;    /**< 2 log likelihood by the measured voltage and current (electrical.h) */
    double merit;         /**< what candidates are ordered by: 2 log likelihood less a price for each searched number */
    double
        smallest_um; /**< of all its probes: least root mean square of the change of the position that would be seen */
    double smallest_value[BLOCK_MAX_PARAMETERS]; /**< the block's numbers at that size, as far as it is proportional to
                                                    them */
} candidate_t;

typedef struct {
    size_t tested; /**< signatures that were tried: the size of the family of tests */
    size_t count;  /**< candidates, best first */
    candidate_t *candidate;
    size_t fitted; /**< samples that speak */
} search_t;

/**
 * Tries the candidates that the evidence's question is about. The ones that explain most are refined, and then fitted
 * together with the hysteresis. Blocks that the baseline has are not tried again, and
 * `without` (NULL: none) is not tried.
 */
void search(const evidence_t *evidence, const noise_t *noise, const model_t *baseline, const probe_setting_t *setting,
            const block_t *without, search_t *found);
/** The best probe of each block, and no more. */
void search_probes(const evidence_t *evidence, const noise_t *noise, const model_t *baseline,
                   const probe_setting_t *setting, const block_t *without, search_t *found);
void search_free(search_t *found);

/** One block alone: its best probe, refined. false: it cannot be simulated there. found: to be freed. */
bool search_block(const evidence_t *evidence, const noise_t *noise, const model_t *baseline,
                  const probe_setting_t *setting, const block_t *block, candidate_t *found);
void candidate_free(candidate_t *candidate);

/** By how much the first candidate's 2 log likelihood exceeds that of another one. */
double search_margin(const search_t *found, size_t other);

/**
 * Root mean square of what a finding changes beyond J, whitened, in parts of the noise: below it, a model that is not
 * quite right is as likely a reason.
 */
extern const double search_least_size;

/** What a searched number has to be worth, in 2 log likelihood; and all those of a block. */
extern const double search_number_price;
double search_price(const block_t *block);

#endif
