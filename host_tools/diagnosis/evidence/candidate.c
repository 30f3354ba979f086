/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/evidence/candidate.h"
#include "diagnosis/evidence/searched.h"
#include "thresholds/thresholds.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { FIT_ITERATIONS = 3 };

void candidate_value(const model_block_t *block, double *value) {
    for (size_t p = 0; p < block->block->parameters; p++) {
        value[p] = block->parameter[p].count > 0 ? block->parameter[p].value[0] : 0.0;
    }
}

size_t candidate_insert(model_t *model, const model_t *baseline, const block_t *block, const double *value) {
    size_t at = 0;
    while (at < baseline->blocks && baseline->block[at].block->place <= block->place) {
        at++;
    }
    model_copy(model, baseline);
    const model_block_t inserted = *model_append(model, block);
    memmove(&model->block[at + 1], &model->block[at], (model->blocks - 1 - at) * sizeof model->block[0]);
    model->block[at] = inserted;
    for (size_t p = 0; p < block->parameters; p++) {
        if (!block->parameter[p].array) {
            model->block[at].parameter[p].value[0] = value[p];
        }
    }
    return at;
}

void candidate_create(const search_problem_t *problem, const block_t *block, const double *value,
                      candidate_t *candidate) {
    *candidate = (candidate_t){.block = block};
    candidate->at = candidate_insert(&candidate->model, problem->baseline, block, value);
    candidate->signature = evidence_signature(problem->evidence, &candidate->model, candidate->at);
}

/* What a probe leaves open. */
static void take_defaults(const block_t *block, double *value) {
    for (size_t p = 0; p < block->parameters; p++) {
        value[p] = block->parameter[p].optional ? block->parameter[p].default_value : 0.0;
    }
}

bool candidate_from_look(const block_t *block, const probe_setting_t *setting, size_t index, double *value) {
    const probe_t *probe = block_search(block);
    take_defaults(block, value);
    return probe->from_look != NULL && probe->from_look(&setting->seen, index, value);
}

/* First those that a look has shown. */
bool candidate_probe(const block_t *block, const probe_setting_t *setting, size_t index, double *value) {
    size_t shown = 0;
    while (candidate_from_look(block, setting, shown, value)) {
        if (shown++ == index) {
            return true;
        }
    }
    take_defaults(block, value);
    return block_search(block)->probe(setting, index - shown, value);
}

bool candidate_proportional(const block_t *block, size_t parameter) {
    return is_searched(block, parameter) && block->parameter[parameter].proportional;
}

bool candidate_grows(const block_t *block) {
    for (size_t p = 0; p < block->parameters; p++) {
        if (candidate_proportional(block, p)) {
            return true;
        }
    }
    return false;
}

bool candidate_never_negative(const block_t *block) {
    for (size_t p = 0; p < block->parameters; p++) {
        if (candidate_proportional(block, p) && searched_low(block, p) >= 0.0) {
            return true;
        }
    }
    return false;
}

void candidate_take_amplitude(model_block_t *inserted, double amplitude) {
    const block_t *block = inserted->block;
    for (size_t p = 0; p < block->parameters; p++) {
        if (candidate_proportional(block, p)) {
            double *value = inserted->parameter[p].value;
            *value = fmax(searched_low(block, p), fmin(block->parameter[p].high, *value * amplitude));
        }
    }
}

void candidate_refine(const search_problem_t *problem, candidate_t *candidate) {
    const evidence_t *evidence = problem->evidence;
    candidate_take_amplitude(&candidate->model.block[candidate->at], candidate->test.amplitude);
    const double left = evidence_refine(evidence, &candidate->model, candidate->at);
    free(candidate->signature);
    candidate->signature = evidence_signature(evidence, &candidate->model, candidate->at);
    if (candidate->signature != NULL && isfinite(left)) {
        candidate->test = evidence_test(evidence, candidate->signature);
        candidate->likelihood = evidence_likelihood(evidence, left);
    } else { /* not even where it started: the chain refuses these numbers, or diverges */
        candidate->test = (evidence_test_t){0};
        candidate->likelihood = 0.0;
    }
}

unsigned candidate_fitted_along(const search_problem_t *problem, const model_t *model) {
    return joint_blocks(model, problem->fitted_along, problem->fitted_along_count);
}

void candidate_fit(const search_problem_t *problem, candidate_t *candidate) {
    failure_t refusal;
    candidate->joint = joint_fit(evidence_samples(problem->evidence), problem->noise, &candidate->model,
                                 1U << candidate->at | candidate_fitted_along(problem, &candidate->model),
                                 FIT_ITERATIONS, &candidate->power, &refusal);
}

void candidate_free(candidate_t *candidate) {
    free(candidate->signature);
    model_free(&candidate->model);
}

void candidates_free(candidates_t *candidates) {
    for (size_t i = 0; i < candidates->count; i++) {
        candidate_free(&candidates->candidate[i]);
    }
    free(candidates->candidate);
}

double candidate_own_um(const candidate_t *candidate) {
    return candidate->test.amplitude * candidate->test.own_um;
}

double candidate_price(const block_t *block) {
    size_t numbers = 0;
    for (unsigned bits = block_search(block)->searched; bits != 0; bits >>= 1) {
        numbers += bits & 1U;
    }
    return threshold.number_price * (double)numbers;
}
