/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "block_pair.h"
#include "catalogue.h"
#include "probing.h"
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

/* A block's numbers at its best, alone. false: it cannot be simulated. */
static bool numbers_of(const search_problem_t *problem, const block_t *block, double *value) {
    candidate_t alone;
    if (!probe_block(problem, block, &alone)) {
        return false;
    }
    candidate_refine(problem, &alone);
    for (size_t p = 0; p < block->parameters; p++) {
        const parameter_t *parameter = &alone.model.block[alone.at].parameter[p];
        value[p] = parameter->count > 0 ? parameter->value[0] : 0.0;
    }
    candidate_free(&alone);
    return true;
}

/* Sum of squares that a candidate leaves together with another block, all numbers fitted; HUGE_VAL if it cannot be. */
static double left_together(const search_problem_t *problem, const candidate_t *candidate, const block_t *other) {
    double value[BLOCK_MAX_PARAMETERS] = {0.0};
    model_t pair;
    joint_power_t power = {.fitted = HUGE_VAL};
    failure_t refusal;
    if (numbers_of(problem, other, value)) {
        const size_t at = candidate_insert(&pair, &candidate->model, other, value);
        const unsigned blocks = 1U << at | 1U << (candidate->at + (at <= candidate->at ? 1 : 0));
        if (!joint_fit(evidence_samples(problem->evidence), problem->noise, &pair, blocks, FIT_ITERATIONS, &power,
                       &refusal)) {
            power.fitted = HUGE_VAL;
        }
        model_free(&pair);
    }
    return power.fitted;
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
    return gain > 3.0 * candidate_number_price ? first : 0;
}
