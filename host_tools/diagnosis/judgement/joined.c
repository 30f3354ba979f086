/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/judgement/joined.h"
#include "diagnosis/evidence/candidate.h"
#include "diagnosis/evidence/searched.h"
#include "thresholds/thresholds.h"
#include <math.h>

static bool joins(const block_t *block, size_t parameter) {
    return (block->probe->joins >> parameter & 1U) != 0;
}

static void begin(model_block_t *block, const probe_setting_t *setting) {
    double value[BLOCK_MAX_PARAMETERS];
    candidate_value(block, value);
    for (size_t p = 0; p < block->block->parameters; p++) {
        if (joins(block->block, p) && !number_is_searched(block, p)) {
            model_set(block, block->block->parameter[p].name, block->block->probe->join(setting, value, p));
        }
    }
}

/* Of an array of one number nothing is known of what its absence means. */
static bool is_determined(const model_block_t *block, size_t p) {
    const parameter_t *parameter = &block->parameter[p];
    return parameter->sigma != NULL &&
           (block->block->parameter[p].array ? isfinite(parameter->sigma[0])
                                             : fabs(parameter->value[0]) > threshold.deviations * parameter->sigma[0]);
}

static void go_back(model_block_t *block, size_t p) {
    const parameter_info_t *info = &block->block->parameter[p];
    model_set_array(block, info->name, info->array ? 0 : 1, &info->default_value, NULL);
}

/* Those that may be nothing go back. Returns how many stay. */
static size_t keep_determined(model_block_t *block) {
    size_t kept = 0;
    for (size_t p = 0; p < block->block->parameters; p++) {
        if (joins(block->block, p) && number_is_searched(block, p)) {
            if (is_determined(block, p)) {
                kept++;
            } else {
                go_back(block, p);
            }
        }
    }
    return kept;
}

static bool fit(const state_t *state, model_t *model, joint_power_t *power) {
    const answer_t *answer = &state->answer;
    const question_t *question = answer->question;
    failure_t refusal;
    return joint_fit(&question->samples, &question->noise, model, blocks_fitted(answer, model), FIT_ITERATIONS, power,
                     &refusal);
}

/* The model with these numbers, as many as are determined; 0: none. */
static size_t fit_joined(const state_t *state, const finding_t *finding, model_t *model, joint_power_t *power) {
    const question_t *question = state->answer.question;
    model_block_t *block = &model->block[finding_index(&state->answer, finding)];
    failure_t refusal;
    begin(block, &state->setting);
    if (!fit(state, model, power) ||
        !joint_errors(&question->samples, &question->noise, model, blocks_fitted(&state->answer, model), &refusal)) {
        return 0;
    }
    const size_t kept = keep_determined(block);
    return kept > 0 && fit(state, model, power) ? kept : 0;
}

static void take(state_t *state, const finding_t *finding) {
    joint_power_t power;
    model_t model;
    model_copy(&model, &state->answer.model);
    const size_t kept = fit_joined(state, finding, &model, &power);
    if (kept > 0 && power.held < state->power.held &&
        (double)state->answer.question->samples.fitted * log(state->power.fitted / power.fitted) >
            threshold.number_price * (double)kept) {
        state_take(state, &model, &power);
    } else {
        model_free(&model);
    }
}

void joined_take(state_t *state) {
    for (size_t f = 0; f < state->answer.findings; f++) {
        if (state->answer.finding[f].block->probe->joins != 0) {
            take(state, &state->answer.finding[f]);
        }
    }
}
