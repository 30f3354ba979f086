/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * A candidate for what a chain lacks: one block of the catalogue, inserted where it belongs in the chain, with numbers.
 *
 * Its numbers get better in three steps, each dearer than the one before, so that fewer candidates take it:
 *
 * - *probed* (probing.h): one of the block's probes (probe.h) as it is;
 * - *refined* (candidate_refine): the block's searched parameters, all that the nuisance subspace imitates left aside
 * (evidence.h);
 * - *fitted* (candidate_fit): these and the numbers of the chain's hysteresis together (joint_fit.h).
 *
 * It is compared by 2 log of its likelihood ratio to the chain without it, and pays a price for each number that was
 * searched.
 */
#ifndef CANDIDATE_H
#define CANDIDATE_H

#include "diagnosis/evidence/evidence.h"
#include "diagnosis/evidence/joint_fit.h"

/** What a block is looked for in. */
typedef struct {
    const evidence_t *evidence; /**< of what the baseline leaves; its question says which blocks are tried */
    const noise_t *noise;
    const model_t *baseline; /**< the chain; blocks that it has are not tried again */
    const probe_setting_t *setting;
    const block_t *without; /**< not tried either; NULL: none */
    const block_t *richer;  /**< tried although it is a richer form (probe_t.in_place_of); NULL: none */
    /** Blocks of the baseline whose numbers are fitted together with those of a block that is tried; NULL: none. */
    const block_t *const *fitted_along;
    size_t fitted_along_count;
} search_problem_t;

typedef struct {
    const block_t *block;
    model_t model;     /**< the baseline with the block in its place, its searched parameters at their best */
    size_t at;         /**< index of the block in the model */
    double *signature; /**< of the block at its best beside the baseline's hysteresis, a column; NULL, with likelihood
                          0, if it cannot be simulated there */
    evidence_test_t test; /**< of that signature; amplitude near 1 once it is refined */
    double likelihood;    /**< 2 log of the likelihood ratio to the baseline, beyond the nuisance subspace */
    bool joint;           /**< fitted together with the hysteresis */
    joint_power_t power;  /**< what is left then */
    bool refused;         /**< by the held-out samples (search_round.h) */
    double electrical;    /**< 2 log likelihood by the measured voltage and current (electrical.h) */
    double merit;         /**< what candidates are ordered by (search.h) */
    double smallest_um;   /**< of all its probes: least root mean square of the change of the position that would be
                             seen; HUGE_VAL: the nuisance subspace imitates them all */
    double smallest_value[BLOCK_MAX_PARAMETERS]; /**< the block's numbers at that size, as far as it is proportional to
                                                    them */
} candidate_t;

/** What came of a search. To be freed. */
typedef struct {
    size_t tested; /**< signatures that were tried: the size of the family of tests */
    size_t count;
    candidate_t *candidate;
} candidates_t;

/** With these numbers, one a parameter; arrays stay absent. Simulated, but not tested yet. To be freed. */
void candidate_create(const search_problem_t *problem, const block_t *block, const double *value,
                      candidate_t *candidate);
/** A chain with the block behind the last one of its place or an earlier one. Returns its index. To be freed. */
size_t candidate_insert(model_t *model, const model_t *baseline, const block_t *block, const double *value);
/** A block's numbers, one a parameter, for this. Of arrays the first. */
void candidate_value(const model_block_t *block, double *value);
/** From where it stands, with the amplitude that its test has found; its test anew. */
void candidate_refine(const search_problem_t *problem, candidate_t *candidate);
/** Bits of problem->fitted_along in a model. */
unsigned candidate_fitted_along(const search_problem_t *problem, const model_t *model);
/** A few iterations: enough to compare with others. */
void candidate_fit(const search_problem_t *problem, candidate_t *candidate);
void candidate_free(candidate_t *candidate);
void candidates_free(candidates_t *candidates);

/** Sets `value` to number `index` of what a look has shown of the block (probe_t.from_look). false: there is none. */
bool candidate_from_look(const block_t *block, const probe_setting_t *setting, size_t index, double *value);
/** Sets `value`, one number per parameter, to number `index` of the block's probes (probe.h); what a probe leaves open
 * has its default. false: there is none. */
bool candidate_probe(const block_t *block, const probe_setting_t *setting, size_t index, double *value);

/** Whether a parameter is searched, and the effect proportional to it. */
bool candidate_proportional(const block_t *block, size_t parameter);
/** Whether the effect is proportional to any number that is searched: then a probe of any size is as good a start. */
bool candidate_grows(const block_t *block);
/** And to one that is never below 0. */
bool candidate_never_negative(const block_t *block);
/** The numbers of an inserted block that the effect is proportional to take an amplitude, within their bounds. */
void candidate_take_amplitude(model_block_t *inserted, double amplitude);

/** Root mean square of what the nuisance subspace leaves of its signature, at its amplitude. */
double candidate_own_um(const candidate_t *candidate);

/** What all searched numbers of a block have to be worth, in 2 log likelihood. */
double candidate_price(const block_t *block);

#endif
