/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/evidence/block_pair.h"
#include "chain/catalogue.h"
#include "diagnosis/evidence/probing.h"
#include "thresholds/thresholds.h"
#include <math.h>
#include <string.h>

enum { FIT_ITERATIONS = 6 }; /* of two blocks, which have never been fitted together */

/* The candidate of a block that was fitted, by name; the number of candidates if there is none. */
static size_t fitted_candidate(const candidates_t *found, const char *name) {
    size_t i = 0;
    while (i < found->count && !(found->candidate[i].joint && strcmp(found->candidate[i].block->name, name) == 0)) {
        i++;
    }
    return i;
}

/* The chain with the first of the two and, at its best in that chain, the second one. Returns which blocks of it these
 * are, as bits; 0: the second one cannot be simulated there. */
static unsigned add_second(const search_problem_t *problem, const candidate_t *first, const block_t *block,
                           model_t *pair) {
    failure_t refusal;
    search_problem_t beside = *problem;
    evidence_t *evidence = evidence_open(&first->model, evidence_samples(problem->evidence), problem->noise, &refusal);
    unsigned blocks = 0;
    candidate_t second;
    if (evidence == NULL) {
        return 0;
    }
    evidence_ask(evidence, evidence_question(problem->evidence));
    beside.evidence = evidence;
    beside.baseline = &first->model;
    if (probe_block(&beside, block, &second)) {
        candidate_refine(&beside, &second);
        blocks = 1U << second.at | 1U << (first->at + (second.at <= first->at ? 1 : 0));
        model_copy(pair, &second.model);
        candidate_free(&second);
    }
    evidence_close(evidence);
    return blocks;
}

/* Sum of squares that a candidate leaves together with another block, all numbers fitted; HUGE_VAL if it cannot be. */
static double left_together(const search_problem_t *problem, const candidate_t *first, const block_t *block) {
    model_t pair;
    failure_t refusal;
    joint_power_t power;
    const unsigned blocks = add_second(problem, first, block, &pair);
    if (blocks == 0) {
        return HUGE_VAL;
    }
    const bool good = joint_fit(evidence_samples(problem->evidence), problem->noise, &pair,
                                blocks | candidate_fitted_along(problem, &pair), FIT_ITERATIONS, &power, &refusal);
    model_free(&pair);
    return good ? power.fitted : HUGE_VAL;
}

size_t block_pair_first(const search_problem_t *problem, const candidates_t *found) {
    const candidate_t *best = &found->candidate[0];
    const char *const *names = found->count > 0 ? best->block->probe->together : NULL;
    if (names == NULL || names[0] == NULL || !best->joint || model_find(problem->baseline, names[1]) != NULL) {
        return 0;
    }
    const size_t first = fitted_candidate(found, names[0]);
    if (first == found->count) {
        return 0;
    }
    const double left = left_together(problem, &found->candidate[first], catalogue_find(names[1]));
    const double gain = (double)evidence_samples(problem->evidence)->fitted * log(best->power.fitted / left);
    return gain > 3.0 * threshold.number_price ? first : 0;
}
