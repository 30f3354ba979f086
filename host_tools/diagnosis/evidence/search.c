/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/evidence/search.h"
#include "base/parallel.h"
#include "diagnosis/evidence/block_pair.h"
#include "diagnosis/evidence/electrical.h"
#include "diagnosis/evidence/probing.h"
#include "thresholds/thresholds.h"
#include <math.h>
#include <stdlib.h>

enum { MOST_REFINED = 8, MOST_FITTED = 4 };

/* 2 log likelihood that is left when each searched number has been paid for: one more makes any block fit better. */
static double merit(const search_problem_t *problem, const candidate_t *candidate) {
    const double paid = candidate_price(candidate->block) - candidate->electrical;
    if (!candidate->joint) {
        return candidate->likelihood - paid;
    }
    /* Fitted with its own hysteresis, which may not be quite the right one, and beside all that the nuisance subspace
     * imitates: in the middle. What is itself a shape has to prove itself with its own; and beside one that is far from
     * linear in its numbers, the nuisance subspace says little. */
    const double joint = -(double)evidence_samples(problem->evidence)->fitted * log(candidate->power.fitted);
    const bool middle =
        evidence_question(problem->evidence) == ASK_EFFECTS && !hysteresis_far_from_linear(&candidate->model);
    return (middle ? 0.5 * (candidate->likelihood + joint) : joint) - paid;
}

static int by_merit(const void *one, const void *other) {
    const candidate_t *a = one, *b = other;
    if (a->joint != b->joint) {
        return a->joint ? -1 : 1;
    }
    return (a->merit < b->merit) - (a->merit > b->merit);
}

static void sort(const search_problem_t *problem, candidates_t *found) {
    for (size_t i = 0; i < found->count; i++) {
        found->candidate[i].merit = merit(problem, &found->candidate[i]);
    }
    qsort(found->candidate, found->count, sizeof(candidate_t), by_merit);
}

void search_probes(const search_problem_t *problem, candidates_t *found) {
    probe_blocks(problem, found);
    sort(problem, found);
}

/* Those that the next step is for. */
typedef struct {
    const search_problem_t *problem;
    candidates_t *found;
    size_t chosen[MOST_REFINED]; /* of the candidates */
} choice_t;

static void refine_chosen(void *context, size_t index) {
    const choice_t *choice = context;
    const search_problem_t *problem = choice->problem;
    candidate_t *candidate = &choice->found->candidate[choice->chosen[index]];
    candidate_refine(problem, candidate);
    candidate->electrical = electrical_likelihood(evidence_samples(problem->evidence), problem->baseline,
                                                  &candidate->model, candidate->block);
}

static void fit_chosen(void *context, size_t index) {
    const choice_t *choice = context;
    candidate_fit(choice->problem, &choice->found->candidate[choice->chosen[index]]);
}

/* The best probe first: what it comes to says which others are worth it. */
static void refine_best(choice_t *choice) {
    const candidates_t *found = choice->found;
    size_t count = 0;
    for (size_t i = 0; i < found->count && i < MOST_REFINED; i++) {
        const double likelihood = found->candidate[i].likelihood;
        if (likelihood > fmax(threshold.least_likelihood, threshold.worth_refining * found->candidate[0].likelihood)) {
            choice->chosen[i == 0 ? 0 : count++] = i;
            if (i == 0) {
                refine_chosen(choice, 0);
            }
        }
    }
    parallel(count, refine_chosen, choice);
}

static void fit_best(choice_t *choice) {
    const candidates_t *found = choice->found;
    const double best = found->count > 0 ? found->candidate[0].likelihood : 0.0;
    const bool anything = evidence_question(choice->problem->evidence) == ASK_ANYTHING;
    size_t count = 0;
    for (size_t i = 0; i < found->count && i < MOST_FITTED; i++) {
        const double likelihood = found->candidate[i].likelihood;
        if (likelihood > threshold.least_likelihood &&
            (anything || likelihood > fmin(threshold.worth_fitting * best, best - threshold.close_likelihood))) {
            choice->chosen[count++] = i;
        }
    }
    parallel(count, fit_chosen, choice);
}

/* Whether the best one could be confused with it: one of its group, or what explains about as much beyond the nuisance
 * subspace. */
static bool to_be_compared(const candidate_t *best, const candidate_t *rival) {
    return rival->likelihood > threshold.least_likelihood &&
           (block_same_group(rival->block, best->block) ||
            rival->likelihood > best->likelihood - threshold.close_likelihood);
}

/* What the best one can be confused with is judged as it is. */
static void fit_rivals(choice_t *choice) {
    const candidates_t *found = choice->found;
    size_t count = 0;
    for (size_t i = 1; i < found->count && found->candidate[0].joint && count < MOST_REFINED; i++) {
        const candidate_t *rival = &found->candidate[i];
        if (!rival->joint && to_be_compared(&found->candidate[0], rival)) {
            choice->chosen[count++] = i;
        }
    }
    parallel(count, fit_chosen, choice);
}

/* Where two blocks explain more than the best one, the first of them comes first. */
static void prefer_pair(const search_problem_t *problem, candidates_t *found) {
    const size_t first = block_pair_first(problem, found);
    if (first > 0) {
        const candidate_t best = found->candidate[0];
        found->candidate[0] = found->candidate[first];
        found->candidate[first] = best;
    }
}

void search(const search_problem_t *problem, candidates_t *found) {
    choice_t choice = {.problem = problem, .found = found};
    search_probes(problem, found);
    refine_best(&choice);
    sort(problem, found);
    fit_best(&choice);
    sort(problem, found);
    fit_rivals(&choice);
    sort(problem, found);
    prefer_pair(problem, found);
}

double search_margin(const candidates_t *found, size_t other) {
    const candidate_t *one = &found->candidate[0], *two = &found->candidate[other];
    if (one->joint && !two->joint && to_be_compared(one, two)) {
        return HUGE_VAL;
    }
    return one->joint == two->joint ? one->merit - two->merit
                                    : one->likelihood + one->electrical - two->likelihood - two->electrical;
}
