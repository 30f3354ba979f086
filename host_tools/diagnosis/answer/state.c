/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/answer/state.h"
#include "diagnosis/evidence/candidate.h"
#include "diagnosis/evidence/searched.h"
#include "diagnosis/nuisance/past.h"
#include "thresholds/thresholds.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

void state_begin(state_t *state, const question_t *question, const family_t *family) {
    state->answer = (answer_t){.question = question, .family = family};
    state->setting = question->setting;
    state->setting.line_hz = state->line_hz;
    memcpy(state->line_hz, question->line_hz, sizeof state->line_hz);
    state->found_um = 0.0;
}

void state_take(state_t *state, const model_t *model, const joint_power_t *power) {
    model_free(&state->answer.model);
    state->answer.model = *model;
    state->power = *power;
}

void state_advance(state_t *state) {
    state->left *= 0.85;
    progress_update(&state->progress, 1.0 - state->left);
}

bool state_measure(const state_t *state, const model_t *model, double *percent, double *held_out_percent) {
    const samples_t *samples = &state->answer.question->samples;
    double *simulated = samples_column(samples);
    const bool good = past_simulate(samples, &state->answer.question->noise, model, simulated, state->failure);
    if (good) {
        *percent = samples_nrmse_percent(samples, SAMPLE_FITTED, simulated);
        *held_out_percent = samples_nrmse_percent(samples, SAMPLE_HELD_OUT, simulated);
    }
    free(simulated);
    return good;
}

unsigned blocks_found(const answer_t *answer, const model_t *model) {
    unsigned blocks = 0;
    for (size_t b = 0; b < model->blocks; b++) {
        const block_t *block = model->block[b].block;
        blocks |= block->probe != NULL && model_find(&answer->baseline, block->name) == NULL ? 1U << b : 0U;
    }
    return blocks;
}

unsigned blocks_fitted(const answer_t *answer, const model_t *model) {
    unsigned heard = 0;
    for (size_t b = 0; b < model->blocks; b++) {
        const finding_t *finding = finding_of(answer, model->block[b].block);
        heard |= finding != NULL && finding->heard ? 1U << b : 0U;
    }
    return (blocks_found(answer, model) & ~heard) | refitted_blocks(answer, model);
}

fitted_chain_t *state_fitted(const state_t *state, const model_t *chain) {
    const samples_t *samples = &state->answer.question->samples;
    return fitted_chain_is_of(state->beside, samples, chain) ? state->beside : kept_chain(state->kept, samples, chain);
}

void state_fit_beside(const state_t *state, const model_t *chain, size_t count) {
    const samples_t *samples = &state->answer.question->samples;
    const model_t *others[KEPT_CHAINS];
    size_t some = 0;
    for (size_t i = 0; i < count && some < KEPT_CHAINS; i++) {
        if (!fitted_chain_is_of(state->beside, samples, &chain[i])) {
            others[some++] = &chain[i];
        }
    }
    kept_chains_prepare(state->kept, samples, others, some);
}

void state_ask_shape(const state_t *state, const model_t *chain, shape_t *shape) {
    const question_t *question = state->answer.question;
    fitted_chain_t *fitted = state_fitted(state, chain);
    *shape = fitted == state->beside ? question->shape : (shape_t){0};
    if (fitted != NULL && fitted != state->beside) {
        shape_of(fitted, question->step_um, shape);
    }
}

double excess(const answer_t *answer, double held) {
    const question_t *question = answer->question;
    return held / ((double)question->samples.held * question->noise.sigma_um * question->noise.sigma_um) - 1.0;
}

unsigned refitted_blocks(const answer_t *answer, const model_t *model) {
    return joint_blocks(model, answer->refitted_block, answer->refitted);
}

void finding_considered_gone(answer_t *answer, const block_t *block, outcome_t why) {
    for (size_t c = 0; c < answer->considered; c++) {
        considered_t *considered = &answer->consideration[c];
        if (considered->block == block && considered->outcome == TAKEN) {
            considered->outcome = why;
        }
    }
}

void finding_considered_taken(answer_t *answer, const block_t *block) {
    for (size_t c = answer->considered; c-- > 0;) {
        if (answer->consideration[c].block == block) {
            answer->consideration[c].outcome = TAKEN;
            return;
        }
    }
}

void findings_insert(answer_t *answer, size_t index, const finding_t *finding) {
    memmove(&answer->finding[index + 1], &answer->finding[index], (answer->findings - index) * sizeof *finding);
    answer->finding[index] = *finding;
    answer->findings++;
}

void findings_add(answer_t *answer, const finding_t *finding) {
    findings_insert(answer, answer->findings, finding);
}

void findings_remove(answer_t *answer, size_t index) {
    answer->findings--;
    memmove(&answer->finding[index], &answer->finding[index + 1],
            (answer->findings - index) * sizeof answer->finding[0]);
}

void finding_rename(answer_t *answer, finding_t *finding, const block_t *block, outcome_t why) {
    if (block != finding->block) {
        finding_considered_gone(answer, finding->block, why);
        finding_considered_taken(answer, block);
        finding->block = block;
    }
}

bool finding_add_rival(finding_t *finding, const block_t *rival) {
    if (finding->rivals == DIAGNOSIS_MOST_RIVALS || finding_has_rival(finding, rival)) {
        return false;
    }
    finding->rival[finding->rivals++] = rival;
    return true;
}

void finding_at_most(finding_t *finding, certainty_t certainty) {
    if (finding->certainty > certainty) {
        finding->certainty = certainty;
    }
}

/* Errors that the baseline came with are not those of this fit. blocks: fitted, beside the hysteresis. */
static void forget_errors(model_t *model, unsigned blocks) {
    for (size_t b = 0; b < model->blocks; b++) {
        const bool fitted = block_is_hysteresis(model->block[b].block) || (blocks >> b & 1U) != 0;
        for (size_t p = 0; fitted && p < model->block[b].block->parameters; p++) {
            free(model->block[b].parameter[p].sigma);
            model->block[b].parameter[p].sigma = NULL;
        }
    }
}

static double accuracy_of(const probe_t *probe, size_t parameter) {
    const bool own = parameter < sizeof probe->accuracy / sizeof(double) && probe->accuracy[parameter] > 0.0;
    return probe->accuracy[own ? parameter : 0];
}

void finding_widen(answer_t *answer, size_t finding) {
    const model_block_t *block = &answer->model.block[finding_index(answer, &answer->finding[finding])];
    for (size_t p = 0; p < block->block->parameters; p++) {
        const parameter_t *parameter = &block->parameter[p];
        if (number_is_searched(block, p) && parameter->sigma != NULL && parameter->sigma[0] > 0.0) {
            parameter->sigma[0] =
                hypot(parameter->sigma[0], accuracy_of(block_search(block->block), p) * parameter->value[0]);
        }
    }
}

/* Whether its numbers and their errors are no fit's: they come from the readings, or from beside the operator. */
static bool is_settled(const finding_t *finding) {
    return finding->in_readings || finding->heard;
}

bool findings_errors(answer_t *answer, failure_t *failure) {
    const question_t *question = answer->question;
    double same_s;
    const size_t same = joint_middle_of_same(&question->samples, &question->noise, &answer->model, &same_s);
    unsigned blocks = refitted_blocks(answer, &answer->model);
    for (size_t f = 0; f < answer->findings; f++) {
        blocks |= is_settled(&answer->finding[f]) ? 0U : 1U << finding_index(answer, &answer->finding[f]);
    }
    forget_errors(&answer->model, blocks);
    if (!joint_errors(&question->samples, &question->noise, &answer->model, blocks, failure)) {
        return false;
    }
    for (size_t f = 0; f < answer->findings; f++) {
        if (!is_settled(&answer->finding[f])) {
            finding_widen(answer, f);
        }
    }
    if (same < answer->model.blocks && answer->model.block[same].parameter[0].sigma != NULL) {
        double *sigma = answer->model.block[same].parameter[0].sigma;
        *sigma = hypot(*sigma, same_s / sqrt(12.0));
    }
    return true;
}

/* A richer form of which the recordings do not say that it is more than the simpler one. */
static bool is_no_more(const model_block_t *block) {
    const probe_t *probe = block->block->probe;
    if (probe == NULL || !probe->extends) {
        return false;
    }
    const parameter_t *by = &block->parameter[probe->extends_by];
    const double away = fmin(fabs(by->value[0]), fabs(1.0 - by->value[0]));
    return by->sigma != NULL && by->sigma[0] * threshold.deviations > away;
}

bool block_determined(const model_block_t *block) {
    if (is_no_more(block)) {
        return false;
    }
    const bool grows = candidate_grows(block->block);
    for (size_t p = 0; p < block->block->parameters; p++) {
        const parameter_t *parameter = &block->parameter[p];
        const bool counts = grows ? candidate_proportional(block->block, p) : is_searched(block->block, p);
        if (counts && parameter->sigma != NULL) {
            const double value = fabs(parameter->value[0]), sigma = parameter->sigma[0];
            const double most =
                block->block->parameter[p].proportional ? 1.0 / threshold.deviations : threshold.least_precision;
            if (sigma < most * value) {
                return true;
            }
        }
    }
    return false;
}

bool finding_determined(const answer_t *answer, const finding_t *finding) {
    return block_determined(&answer->model.block[finding_index(answer, finding)]);
}
