/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "search.h"
#include "catalogue.h"
#include "electrical.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Candidates whose best probe explains at least this part of what the best of all explains are refined; and then at
 * least this part, or so close, are fitted together with the hysteresis. */
static const double worth_refining = 0.2, worth_fitting = 0.6, close_likelihood = 60.0;
enum { MOST_REFINED = 8, MOST_FITTED = 4, FIT_ITERATIONS = 3 };
/* And at least this much: nothing below it is significant. */
static const double least_likelihood = 15.0;
const double search_least_size = 0.08;
/* What J leaves less than this part of is imitated: its size would be a matter of the model's last digits. */
static const double least_own_part = 1e-3;
/* Of a number, in 2 log likelihood: about the logarithm of the number of samples. */
const double search_number_price = 10.0;

/* Where a block goes in a chain: behind the last block of its place or an earlier one. */
static size_t place_in_chain(const model_t *model, const block_t *block) {
    size_t at = 0;
    while (at < model->blocks && model->block[at].block->place <= block->place) {
        at++;
    }
    return at;
}

/* The baseline with the block inserted; value: one number a parameter, arrays absent. */
static void insert_block(model_t *model, const model_t *baseline, const block_t *block, const double *value) {
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
    start_from_amplitude(candidate);
    const double left = evidence_refine(evidence, &candidate->model, candidate->at);
    free(candidate->signature);
    candidate->signature = evidence_signature(evidence, &candidate->model, candidate->at);
    if (candidate->signature != NULL && isfinite(left)) {
        candidate->test = evidence_test(evidence, candidate->signature);
        candidate->likelihood = evidence_likelihood(evidence, left);
    } else { /* not even where it started: the chain refuses these numbers, or runs away */
        candidate->test = (evidence_test_t){0};
        candidate->likelihood = 0.0;
    }
}

/* 2 log likelihood that is left when each searched number has been paid for: one more makes any block fit better. */
static double merit(const candidate_t *candidate, size_t fitted, question_t question) {
    size_t numbers = 0;
    for (unsigned bits = candidate->block->probe->searched; bits != 0; bits >>= 1) {
        numbers += bits & 1U;
    }
    const double paid = search_number_price * (double)numbers - candidate->electrical;
    const double joint = candidate->joint ? -(double)fitted * log(candidate->power.fitted) : 0.0;
    /* Fitted with its own hysteresis, which may not be quite the right one, and beside all that J imitates: in the
     * middle. What is itself a shape has to prove itself with its own. */
    return !candidate->joint         ? candidate->likelihood - paid
           : question == ASK_EFFECTS ? 0.5 * (candidate->likelihood + joint) - paid
                                     : joint - paid;
}

static int by_merit(const void *one, const void *other) {
    const candidate_t *a = one, *b = other;
    if (a->joint != b->joint) {
        return a->joint ? -1 : 1;
    }
    return (a->merit < b->merit) - (a->merit > b->merit);
}

/* How small it could be and still be seen. */
static void note_smallest(const evidence_t *evidence, const candidate_t *trial, double sigma_um, candidate_t *best) {
    const evidence_test_t *test = &trial->test;
    if (test->own_part > least_own_part && test->own_um > 0.0) {
        const double amplitude = search_least_size * sigma_um / test->own_um;
        const double smallest = amplitude * samples_rms(evidence_samples(evidence), trial->signature);
        if (smallest < best->smallest_um) {
            best->smallest_um = smallest;
            for (size_t p = 0; p < trial->block->parameters; p++) {
                const parameter_info_t *info = &trial->block->parameter[p];
                const parameter_t *parameter = &trial->model.block[trial->at].parameter[p];
                best->smallest_value[p] =
                    parameter->count > 0 ? parameter->value[0] * (info->proportional ? amplitude : 1.0) : 0.0;
            }
        }
    }
}

static void sort(search_t *found, question_t question) {
    for (size_t i = 0; i < found->count; i++) {
        found->candidate[i].merit = merit(&found->candidate[i], found->fitted, question);
    }
    qsort(found->candidate, found->count, sizeof(candidate_t), by_merit);
}

/* Whether the effect is proportional to a number that cannot be below 0. */
static bool never_negative(const block_t *block) {
    for (size_t p = 0; p < block->parameters; p++) {
        const parameter_info_t *info = &block->parameter[p];
        if ((block->probe->searched >> p & 1U) != 0 && info->proportional && info->low >= 0.0) {
            return true;
        }
    }
    return false;
}

/* The best of a block's probes. false: none can be simulated. */
static bool probe_block(const evidence_t *evidence, const model_t *baseline, const probe_setting_t *setting,
                        const block_t *block, double sigma_um, candidate_t *best, size_t *tested) {
    double value[BLOCK_MAX_PARAMETERS];
    candidate_t smallest = {.smallest_um = HUGE_VAL};
    memset(best, 0, sizeof *best);
    for (size_t index = 0;; index++) {
        candidate_t trial = {.block = block, .at = place_in_chain(baseline, block)};
        for (size_t p = 0; p < block->parameters; p++) {
            value[p] = block->parameter[p].optional ? block->parameter[p].default_value : 0.0;
        }
        if (!block->probe->probe(setting, index, value)) {
            best->smallest_um = smallest.smallest_um;
            memcpy(best->smallest_value, smallest.smallest_value, sizeof best->smallest_value);
            return best->block != NULL;
        }
        insert_block(&trial.model, baseline, block, value);
        trial.signature = evidence_signature(evidence, &trial.model, trial.at);
        if (trial.signature != NULL) {
            trial.test = evidence_test(evidence, trial.signature);
            trial.likelihood = evidence_likelihood(evidence, 1.0 - trial.test.explained);
            if (trial.test.amplitude < 0.0 && never_negative(block)) {
                trial.likelihood = 0.0;
            }
            note_smallest(evidence, &trial, sigma_um, &smallest);
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

static bool asked(const probe_t *probe, question_t question) {
    return question == ASK_ANYTHING || probe->shape == (question == ASK_SHAPES);
}

void search_probes(const evidence_t *evidence, const noise_t *noise, const model_t *baseline,
                   const probe_setting_t *setting, search_t *found) {
    const question_t question = evidence_question(evidence);
    *found = (search_t){.candidate = allocate(catalogue_count, sizeof(candidate_t)),
                        .fitted = evidence_samples(evidence)->fitted};
    for (size_t i = 0; i < catalogue_count; i++) {
        const block_t *block = catalogue[i];
        if (block->probe != NULL && asked(block->probe, question) && model_find(baseline, block->name) == NULL &&
            probe_block(evidence, baseline, setting, block, noise->sigma_um, &found->candidate[found->count],
                        &found->tested)) {
            found->count++;
        }
    }
    sort(found, question);
}

void search(const evidence_t *evidence, const noise_t *noise, const model_t *baseline, const probe_setting_t *setting,
            search_t *found) {
    const samples_t *samples = evidence_samples(evidence);
    const question_t question = evidence_question(evidence);
    search_probes(evidence, noise, baseline, setting, found);
    for (size_t i = 0; i < found->count && i < MOST_REFINED; i++) {
        candidate_t *candidate = &found->candidate[i];
        if (candidate->likelihood > fmax(least_likelihood, worth_refining * found->candidate[0].likelihood)) {
            refine_candidate(evidence, candidate);
            candidate->electrical = electrical_likelihood(samples, baseline, &candidate->model, candidate->block);
        }
    }
    sort(found, question);
    const double best = found->count > 0 ? found->candidate[0].likelihood : 0.0;
    for (size_t i = 0; i < found->count && i < MOST_FITTED; i++) {
        candidate_t *candidate = &found->candidate[i];
        failure_t refusal;
        if (candidate->likelihood > least_likelihood &&
            (evidence_question(evidence) == ASK_ANYTHING ||
             candidate->likelihood > fmin(worth_fitting * best, best - close_likelihood))) {
            candidate->joint = joint_fit(samples, noise, &candidate->model, 1U << candidate->at, FIT_ITERATIONS,
                                         &candidate->power, &refusal);
        }
    }
    sort(found, question);
}

double search_margin(const search_t *found, size_t other) {
    const candidate_t *one = &found->candidate[0], *two = &found->candidate[other];
    return one->joint == two->joint ? one->merit - two->merit
                                    : one->likelihood + one->electrical - two->likelihood - two->electrical;
}

void search_free(search_t *found) {
    for (size_t i = 0; i < found->count; i++) {
        free(found->candidate[i].signature);
        model_free(&found->candidate[i].model);
    }
    free(found->candidate);
}
