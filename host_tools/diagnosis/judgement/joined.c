/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/judgement/joined.h"
#include "diagnosis/evidence/candidate.h"
#include "diagnosis/evidence/searched.h"
#include "thresholds/thresholds.h"
#include <math.h>

static bool joins(const block_t *block, size_t parameter) {
    return (block->probe->joins >> parameter & 1U) != 0;
}

static void begin(const model_block_t *block, const probe_setting_t *setting) {
    double value[BLOCK_MAX_PARAMETERS];
    candidate_value(block, value);
    for (size_t p = 0; p < block->block->parameters; p++) {
        if (joins(block->block, p) && !number_is_searched(block, p)) {
            block->parameter[p].value[0] = block->block->probe->join(setting, value, p);
        }
    }
}

/* Those that may be nothing go back. Returns how many stay. */
static size_t keep_determined(const model_block_t *block) {
    size_t kept = 0;
    for (size_t p = 0; p < block->block->parameters; p++) {
        const parameter_t *parameter = &block->parameter[p];
        if (joins(block->block, p) && number_is_searched(block, p)) {
            if (parameter->sigma != NULL && fabs(parameter->value[0]) > threshold.deviations * parameter->sigma[0]) {
                kept++;
            } else {
                parameter->value[0] = block->block->parameter[p].default_value;
            }
        }
    }
    return kept;
}

static bool fit(const state_t *state, model_t *model, joint_power_t *power, failure_t *failure) {
    const answer_t *answer = &state->answer;
    const question_t *question = answer->question;
    return joint_fit(&question->samples, &question->noise, model, blocks_fitted(answer, model), FIT_ITERATIONS, power,
                     failure);
}

static bool take(state_t *state, const finding_t *finding) {
    const answer_t *answer = &state->answer;
    const question_t *question = answer->question;
    joint_power_t power;
    model_t model;
    size_t kept = 0;
    model_copy(&model, &answer->model);
    const model_block_t *block = &model.block[finding_index(answer, finding)];
    begin(block, &state->setting);
    bool good =
        fit(state, &model, &power, state->failure) &&
        joint_errors(&question->samples, &question->noise, &model, blocks_fitted(answer, &model), state->failure);
    if (good) {
        kept = keep_determined(block);
        good = kept == 0 || fit(state, &model, &power, state->failure);
    }
    if (good && kept > 0 && power.held < state->power.held &&
        (double)question->samples.fitted * log(state->power.fitted / power.fitted) >
            threshold.number_price * (double)kept) {
        state_take(state, &model, &power);
    } else {
        model_free(&model);
    }
    return good;
}

bool joined_take(state_t *state) {
    bool good = true;
    for (size_t f = 0; good && f < state->answer.findings; f++) {
        const finding_t *finding = &state->answer.finding[f];
        good = finding->block->probe->joins == 0 || take(state, finding);
    }
    return good;
}
