/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "block_pair.h"
#include "catalogue.h"
#include "probing.h"
#include <math.h>
#include <string.h>

enum { FIT_ITERATIONS = 6 }; /* of two blocks, which have never been fitted together */

/* The candidate of a block, by name; the number of candidates if there is none. */
static size_t candidate_of(const candidates_t *found, const char *name) {
    size_t i = 0;
    while (i < found->count && strcmp(found->candidate[i].block->name, name) != 0) {
        i++;
    }
    return i;
}

static void copy_numbers(const candidate_t *candidate, double *value) {
    for (size_t p = 0; p < candidate->block->parameters; p++) {
        const parameter_t *parameter = &candidate->model.block[candidate->at].parameter[p];
        value[p] = parameter->count > 0 ? parameter->value[0] : 0.0;
    }
}

/* A block's numbers at its best, alone: as the search has found them, or found now. false: it cannot be simulated. */
static bool find_numbers(const search_problem_t *problem, const candidates_t *found, const block_t *block,
                         double *value) {
    const size_t known = candidate_of(found, block->name);
    candidate_t alone;
    if (known < found->count && found->candidate[known].refined) {
        copy_numbers(&found->candidate[known], value);
        return true;
    }
    if (!probe_block(problem, block, &alone)) {
        return false;
    }
    candidate_refine(problem, &alone);
    copy_numbers(&alone, value);
    candidate_free(&alone);
    return true;
}

/* Sum of squares that a candidate leaves together with another block, all numbers fitted; HUGE_VAL if it cannot be. */
static double left_together(const search_problem_t *problem, const candidates_t *found, const candidate_t *candidate,
                            const block_t *other) {
    double value[BLOCK_MAX_PARAMETERS] = {0.0};
    model_t pair;
    joint_power_t power = {.fitted = HUGE_VAL};
    failure_t refusal;
    if (find_numbers(problem, found, other, value)) {
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
    const size_t first = candidate_of(found, names[0]);
    if (first == found->count || !found->candidate[first].joint) {
        return 0;
    }
    const double left = left_together(problem, found, &found->candidate[first], catalogue_find(names[1]));
    const double gain = (double)evidence_samples(problem->evidence)->fitted * log(best->power.fitted / left);
    return gain > 3.0 * candidate_number_price ? first : 0;
}
