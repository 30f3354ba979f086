/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "search.h"
#include "catalogue.h"
#include "hysteresis_refit.h"
#include "simplex.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Candidates whose best probe explains at least this part of what the best of all explains are refined. */
static const double worth_refining = 0.3;
enum { MOST_REFINED = 5, MOST_IN_THE_END = 3, ROUNDS = 6 };
/* A further round with the bank ends when it gains less than this. */
static const double settled_likelihood = 2.0;
/* And at least this much: nothing below it is significant. */
static const double least_likelihood = 15.0;

size_t place_in_chain(const model_t *model, const block_t *block) {
    size_t at = 0;
    while (at < model->blocks && model->block[at].block->place <= block->place) {
        at++;
    }
    return at;
}

/* The baseline with the block inserted; values: one number a parameter, arrays absent. */
static void insert(model_t *model, const model_t *baseline, const block_t *block, const double *value) {
    const size_t at = place_in_chain(baseline, block);
    model_block_t inserted;
    model_copy(model, baseline);
    model_append(model, block);
    inserted = model->block[model->blocks - 1];
    memmove(&model->block[at + 1], &model->block[at], (model->blocks - 1 - at) * sizeof model->block[0]);
    model->block[at] = inserted;
    for (size_t p = 0; p < block->parameters; p++) {
        if (!block->parameter[p].array) {
            model->block[at].parameter[p].value[0] = value[p];
        }
    }
}

static double likelihood_of(const evidence_t *evidence, double explained) {
    return explained < 1.0 ? -(double)evidence_samples(evidence) * log1p(-explained) : HUGE_VAL;
}

typedef struct {
    const evidence_t *evidence;
    candidate_t *candidate;
    size_t unknowns, parameter[BLOCK_MAX_PARAMETERS];
    bool logarithmic[BLOCK_MAX_PARAMETERS];
    double scale[BLOCK_MAX_PARAMETERS];
} refinement_t;

static double *number(const refinement_t *r, size_t i) {
    return r->candidate->model.block[r->candidate->at].parameter[r->parameter[i]].value;
}

static void set(const refinement_t *r, const double *x) {
    for (size_t i = 0; i < r->unknowns; i++) {
        *number(r, i) = r->logarithmic[i] ? exp(x[i]) : x[i] * r->scale[i];
    }
}

/* What is left of the residual when the block stands there at amplitude 1, in parts of what was there. */
static double left(const double *x, void *context) {
    const refinement_t *r = context;
    double *signature, remaining;
    set(r, x);
    signature = evidence_signature(r->evidence, &r->candidate->model);
    if (signature == NULL) {
        return HUGE_VAL;
    }
    remaining = evidence_remaining(r->evidence, signature);
    free(signature);
    return remaining;
}

/* Which parameters, and how: in their logarithm if they are positive, else as multiples of where they start. */
static void begin(refinement_t *r, const evidence_t *evidence, candidate_t *candidate, double *x) {
    const block_t *block = candidate->block;
    r->evidence = evidence;
    r->candidate = candidate;
    r->unknowns = 0;
    for (size_t p = 0; p < block->parameters; p++) {
        if ((block->probe->searched >> p & 1U) != 0) {
            const double value = candidate->model.block[candidate->at].parameter[p].value[0];
            const size_t i = r->unknowns++;
            r->parameter[i] = p;
            r->logarithmic[i] = block->parameter[p].low >= 0.0 && value > 0.0;
            r->scale[i] = value != 0.0 ? fabs(value) : 0.01;
            x[i] = r->logarithmic[i] ? log(value) : value / r->scale[i];
        }
    }
}

/* A parameter that the effect is proportional to takes the amplitude that the linear test has found. */
static void start_from_amplitude(candidate_t *candidate) {
    const block_t *block = candidate->block;
    model_block_t *inserted = &candidate->model.block[candidate->at];
    for (size_t p = 0; p < block->parameters; p++) {
        const parameter_info_t *info = &block->parameter[p];
        double *value = inserted->parameter[p].value;
        if ((block->probe->searched >> p & 1U) != 0 && info->proportional) {
            *value = fmax(info->low, fmin(info->high, *value * candidate->test.amplitude));
        }
    }
}

static void refine_candidate(const evidence_t *evidence, candidate_t *candidate) {
    double x[BLOCK_MAX_PARAMETERS];
    refinement_t r;
    begin(&r, evidence, candidate, x);
    const simplex_job_t job = {.function = left,
                               .context = &r,
                               .dimensions = r.unknowns,
                               .step = 0.1,
                               .size = 1e-4,
                               .most_iterations = 60 * r.unknowns};
    const double remaining = simplex_minimise(&job, x);
    set(&r, x);
    free(candidate->signature);
    candidate->signature = evidence_signature(evidence, &candidate->model);
    if (candidate->signature != NULL) {
        candidate->test = evidence_test(evidence, candidate->signature);
        candidate->likelihood = likelihood_of(evidence, 1.0 - remaining);
    } else { /* not even where it started: the chain refuses these numbers, or runs away */
        candidate->test = (evidence_test_t){0};
        candidate->likelihood = 0.0;
    }
}

/* The hysteresis was fitted to a residual that the block has left in it. Fitted again behind the block, it stands for
 * the hysteresis alone, and the block's numbers are searched once more. */
static void refine_with_hysteresis(const evidence_t *evidence, candidate_t *candidate) {
    failure_t ignored;
    if (hysteresis_refit(&candidate->model, evidence_recordings(evidence), evidence_count(evidence), &ignored)) {
        refine_candidate(evidence, candidate);
    }
}

static int by_likelihood(const void *one, const void *other) {
    const double a = ((const candidate_t *)one)->likelihood, b = ((const candidate_t *)other)->likelihood;
    return (a < b) - (a > b);
}

/* The best of a block's probes. false: none can be simulated. */
static bool probe_block(const evidence_t *evidence, const model_t *baseline, const probe_setting_t *setting,
                        const block_t *block, candidate_t *best, size_t *tested) {
    double value[BLOCK_MAX_PARAMETERS];
    memset(best, 0, sizeof *best);
    for (size_t index = 0;; index++) {
        candidate_t trial = {.block = block, .at = place_in_chain(baseline, block)};
        for (size_t p = 0; p < block->parameters; p++) {
            value[p] = block->parameter[p].optional ? block->parameter[p].default_value : 0.0;
        }
        if (!block->probe->probe(setting, index, value)) {
            return best->block != NULL;
        }
        insert(&trial.model, baseline, block, value);
        trial.signature = evidence_signature(evidence, &trial.model);
        if (trial.signature != NULL) {
            trial.test = evidence_test(evidence, trial.signature);
            trial.likelihood = likelihood_of(evidence, trial.test.explained);
            (*tested)++;
        }
        if (trial.signature != NULL && (best->block == NULL || trial.likelihood > best->likelihood)) {
            candidate_t worse = *best;
            *best = trial;
            trial = worse;
        }
        free(trial.signature);
        model_free(&trial.model);
    }
}

void search(const evidence_t *evidence, const model_t *baseline, const probe_setting_t *setting, bool shapes,
            search_t *found) {
    *found = (search_t){.candidate = allocate(catalogue_count, sizeof(candidate_t))};
    for (size_t i = 0; i < catalogue_count; i++) {
        const block_t *block = catalogue[i];
        if (block->probe != NULL && block->probe->shape == shapes && model_find(baseline, block->name) == NULL &&
            probe_block(evidence, baseline, setting, block, &found->candidate[found->count], &found->tested)) {
            found->count++;
        }
    }
    qsort(found->candidate, found->count, sizeof(candidate_t), by_likelihood);
    for (int round = 0; round < ROUNDS; round++) {
        const double worth = worth_refining * found->candidate[0].likelihood;
        const size_t most = round < 2 ? MOST_REFINED : MOST_IN_THE_END;
        for (size_t i = 0; i < found->count && i < most; i++) {
            candidate_t *candidate = &found->candidate[i];
            if (candidate->likelihood <= worth || candidate->likelihood <= least_likelihood) {
                continue;
            }
            if (round == 0) {
                start_from_amplitude(candidate);
                refine_candidate(evidence, candidate);
            } else if (!candidate->settled) {
                const double before = candidate->likelihood;
                refine_with_hysteresis(evidence, candidate);
                candidate->settled = candidate->likelihood < before + settled_likelihood;
            }
        }
        qsort(found->candidate, found->count, sizeof(candidate_t), by_likelihood);
    }
}

void polish(const evidence_t *evidence, model_t *model, const block_t *block) {
    candidate_t candidate = {.block = block, .model = *model};
    while (model->block[candidate.at].block != block) {
        candidate.at++;
    }
    refine_candidate(evidence, &candidate); /* changes numbers in place: the model's own */
    free(candidate.signature);
}

void search_free(search_t *found) {
    for (size_t i = 0; i < found->count; i++) {
        free(found->candidate[i].signature);
        model_free(&found->candidate[i].model);
    }
    free(found->candidate);
}
