/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/search/attempt.h"
#include "chain/catalogue.h"
#include "diagnosis/answer/state.h"
#include "diagnosis/columns/measured_columns.h"
#include "diagnosis/columns/sides.h"
#include "diagnosis/evidence/candidate.h"
#include "diagnosis/evidence/searched.h"
#include "diagnosis/judgement/joined.h"
#include "diagnosis/judgement/names.h"
#include "diagnosis/judgement/no_physics.h"
#include "diagnosis/judgement/reconsider.h"
#include "diagnosis/judgement/refitted.h"
#include "diagnosis/judgement/verdict.h"
#include "diagnosis/noise/lattice.h"
#include "diagnosis/nuisance/past.h"
#include "diagnosis/nuisance/past_choice.h"
#include "diagnosis/search/search_round.h"
#include "thresholds/thresholds.h"
#include <math.h>
#include <stdlib.h>

enum { BASELINE_ITERATIONS = 4 };

/* NULL: the catalogue has none. */
static const block_t *block_of_steps(void) {
    for (size_t i = 0; i < catalogue_count; i++) {
        if (catalogue[i]->readings == READINGS_STEPPED) {
            return catalogue[i];
        }
    }
    return NULL;
}

/* A converter's steps show in the readings themselves. */
static void find_steps(state_t *state) {
    answer_t *answer = &state->answer;
    const question_t *question = answer->question;
    const block_t *steps = block_of_steps();
    const double step = state->answer.question->step_um, error_um = step / sqrt(12.0);
    if (steps != NULL && step > 0.0 && error_um > threshold.least_steps * question->noise.rms_um &&
        answer->findings < DIAGNOSIS_MOST_FINDINGS) {
        const double each = lattice_likelihood_per_sample();
        const double t = sqrt(each * (double)question->samples.fitted);
        model_block_t *block = model_append(&answer->model, steps);
        model_set(block, steps->parameter[0].name, step);
        block->parameter[0].sigma = allocate(1, sizeof(double));
        *block->parameter[0].sigma = state->answer.question->step_sigma_um;
        findings_add(answer, &(finding_t){.block = steps,
                                          .t = t,
                                          .t_blocks = t,
                                          .certainty = NAMED,
                                          .in_readings = true,
                                          .margin = HUGE_VAL,
                                          .support = each * (double)question->samples.held,
                                          .held_out_before_percent = answer->held_out_percent,
                                          .held_out_after_percent = answer->held_out_percent});
    }
}

/* A chain with blocks that are not in the baseline, fitted again. */
typedef struct {
    model_t model;
    joint_power_t power;
    double held_out_percent;
} refit_t;

static bool fit_with(state_t *state, refit_t *refit) {
    const question_t *question = state->answer.question;
    double ignored;
    return joint_fit(&question->samples, &question->noise, &refit->model, blocks_fitted(&state->answer, &refit->model),
                     FIT_ITERATIONS, &refit->power, state->failure) &&
           state_measure(state, &refit->model, &ignored, &refit->held_out_percent);
}

/* What one of the blocks of a chain does beside the others. *missed: the held-out samples are far worse without it. */
static bool weigh_without(state_t *state, const refit_t *with, const block_t *block, finding_t *finding, bool *missed) {
    const samples_t *samples = &state->answer.question->samples;
    refit_t without;
    *missed = !no_physics(samples, model_find(&with->model, block->name));
    model_copy(&without.model, &with->model);
    model_remove_block(&without.model, block);
    const bool good = fit_with(state, &without);
    model_free(&without.model);
    if (good) {
        const double gain = (double)samples->fitted * log(without.power.fitted / with->power.fitted);
        *finding = (finding_t){.block = block,
                               .shape = block->probe->shape,
                               .t = sqrt(fmax(0.0, gain)),
                               .t_blocks = sqrt(fmax(0.0, gain)),
                               .certainty = NAMED,
                               .margin = HUGE_VAL,
                               .support = (double)samples->held * log(without.power.held / with->power.held),
                               .held_out_before_percent = without.held_out_percent,
                               .held_out_after_percent = with->held_out_percent};
        *missed = *missed && finding->support > threshold.support_enough;
    }
    return good;
}

/* What a fit has found together is put in together: beside the others each is missed, alone it may explain nothing. If
 * one is not missed, none is put in. */
static bool put_together(state_t *state, const begin_t *begin) {
    answer_t *answer = &state->answer;
    finding_t finding[DIAGNOSIS_MOST_FINDINGS];
    bool missed = true;
    refit_t with;
    model_copy(&with.model, begin->model);
    bool good = fit_with(state, &with);
    for (size_t i = 0; good && missed && i < begin->blocks; i++) {
        good = weigh_without(state, &with, begin->block[i], &finding[i], &missed);
    }
    if (!good || !missed) {
        model_free(&with.model);
        return good;
    }
    state->found_um =
        sqrt(fmax(0.0, state->power.fitted - with.power.fitted) / (double)answer->question->samples.fitted);
    state_take(state, &with.model, &with.power);
    for (size_t i = 0; i < begin->blocks; i++) {
        findings_add(answer, &finding[i]);
    }
    joined_take(state);
    return true;
}

/* A hysteresis that was fitted to an effect as well has taken a part of it. */
static bool begin_elsewhere(state_t *state, const begin_t *begin) {
    answer_t *answer = &state->answer;
    const question_t *question = answer->question;
    model_free(&answer->model);
    model_copy(&answer->model, begin->model);
    for (size_t i = 0; i < begin->blocks; i++) {
        model_remove_block(&answer->model, begin->block[i]);
    }
    return joint_power(&question->samples, &question->noise, &answer->model, &state->power, state->failure) &&
           (begin->blocks == 0 || put_together(state, begin));
}

static bool fit_again(state_t *state) {
    answer_t *answer = &state->answer;
    const question_t *question = answer->question;
    refitted_choose(answer, &answer->model);
    return joint_fit(&question->samples, &question->noise, &answer->model, refitted_blocks(answer, &answer->model),
                     answer->refitted > 0 ? FIT_ITERATIONS : BASELINE_ITERATIONS, &state->power, state->failure);
}

/* What is slow begins with the position that the hysteresis had then, though the recording erases it. With what was
 * found it is known better than it was with the baseline alone. */
static void choose_beginning(state_t *state) {
    answer_t *answer = &state->answer;
    const question_t *question = answer->question;
    if (answer->findings == 0 || answer->family == NULL || question->samples.past_matters ||
        question->samples.count > 1) {
        return;
    }
    model_t model;
    joint_power_t power;
    failure_t refusal;
    model_copy(&model, &answer->model);
    if (choose_past(&question->samples, left_of_beginning, NULL, &model) &&
        joint_fit(&question->samples, &question->noise, &model, blocks_fitted(answer, &model), FIT_ITERATIONS, &power,
                  &refusal) &&
        power.fitted < state->power.fitted) {
        state_take(state, &model, &power);
    } else {
        model_free(&model);
    }
}

/* It was estimated before anything was found, and may have had a part of that in it: it is no more than what is left.
 */
static double told_noise(const answer_t *answer) {
    const question_t *question = answer->question;
    const double left_percent = fmax(answer->nrmse_percent, answer->held_out_percent);
    return remainder_knows_noise(&question->samples, &question->noise)
               ? fmin(samples_percent(&question->samples, question->noise.rms_um), left_percent)
               : HUGE_VAL;
}

static bool reach_end(state_t *state, double missing) {
    state->answer.noise_percent = told_noise(&state->answer);
    find_steps(state);
    return verdict_reach(state, missing);
}

/* missing: beyond the noise, in parts of it, with the chain fitted again. */
static bool fit_baseline(state_t *state, const model_t *given, double *missing) {
    answer_t *answer = &state->answer;
    model_copy(&answer->given, given);
    model_copy(&answer->model, given);
    const bool good = fit_again(state);
    model_copy(&answer->baseline, &answer->model);
    *missing = excess(answer, state->power.held);
    return good &&
           state_measure(state, &answer->given, &answer->given_nrmse_percent, &answer->given_held_out_percent) &&
           state_measure(state, &answer->baseline, &answer->baseline_nrmse_percent, &answer->baseline_held_out_percent);
}

bool attempt_from(state_t *state, const model_t *given, const begin_t *begin) {
    answer_t *answer = &state->answer;
    bool found = true;
    double missing;
    bool good = fit_baseline(state, given, &missing) && (begin == NULL || begin_elsewhere(state, begin));
    while (good && found && answer->findings < DIAGNOSIS_MOST_FINDINGS) {
        good = search_round(state, &found);
    }
    good = good && reconsider_superfluous(state, threshold.least_size, 0);
    if (good) {
        choose_beginning(state);
    }
    good = good && names_settle(state) && sides_settle(state) && reconsider_undetermined(state) &&
           temperature_settle(state) &&
           state_measure(state, &answer->model, &answer->nrmse_percent, &answer->held_out_percent);
    return good && reach_end(state, missing);
}

/* With its numbers and their standard errors, which no fit changes. Returns whether all of its searched numbers have
 * one. */
static bool put_heard(answer_t *answer, const heard_t *heard, size_t index) {
    const suspect_t *suspect = &heard->suspect[index];
    const model_block_t *block = &suspect->chain.block[suspect->at];
    double value[BLOCK_MAX_PARAMETERS];
    bool all = true;
    model_t with;
    candidate_value(block, value);
    const size_t at = candidate_insert(&with, &answer->model, suspect->block, value);
    for (size_t p = 0; p < suspect->block->parameters; p++) {
        if (block->parameter[p].sigma != NULL) {
            with.block[at].parameter[p].sigma = allocate(1, sizeof(double));
            *with.block[at].parameter[p].sigma = *block->parameter[p].sigma;
        } else if (is_searched(suspect->block, p)) {
            all = false;
        }
    }
    model_free(&answer->model);
    answer->model = with;
    findings_add(answer, &(finding_t){.block = suspect->block,
                                      .t = suspect->amplitude / suspect->sigma,
                                      .t_blocks = suspect->amplitude / suspect->sigma,
                                      .certainty = ISOLATED,
                                      .heard = true,
                                      .margin = HUGE_VAL,
                                      .support = 2.0 * suspect->gain,
                                      .held_out_before_percent = heard->before_percent[index],
                                      .held_out_after_percent = heard->after_percent[index]});
    finding_widen(answer, answer->findings - 1);
    return all;
}

/* Numbers that the operator imitates, as an offset is of what leaks away, are those at which the hysteresis of few
 * numbers comes nearest. All others stay. */
static bool fit_open_numbers(state_t *state) {
    answer_t *answer = &state->answer;
    const question_t *question = answer->question;
    model_t free;
    joint_power_t power;
    model_copy(&free, &answer->model);
    bool good = joint_fit(&question->samples, &question->noise, &free, blocks_found(answer, &free), FIT_ITERATIONS,
                          &power, state->failure);
    for (size_t f = 0; good && f < answer->findings; f++) {
        const size_t at = finding_index(answer, &answer->finding[f]);
        model_block_t *block = &answer->model.block[at];
        for (size_t p = 0; p < block->block->parameters; p++) {
            if (number_is_searched(block, p) && block->parameter[p].sigma == NULL) {
                block->parameter[p].value[0] = free.block[at].parameter[p].value[0];
            }
        }
    }
    model_free(&free);
    return good;
}

bool attempt_with(state_t *state, const model_t *given, const heard_t *heard) {
    answer_t *answer = &state->answer;
    const question_t *question = answer->question;
    double missing;
    bool determined = true;
    if (!fit_baseline(state, given, &missing)) {
        return false;
    }
    for (size_t i = 0; i < heard->count; i++) {
        determined = put_heard(answer, heard, i) && determined;
    }
    return (determined || fit_open_numbers(state)) &&
           joint_fit(&question->samples, &question->noise, &answer->model, refitted_blocks(answer, &answer->model),
                     FIT_ITERATIONS, &state->power, state->failure) &&
           findings_errors(answer, state->failure) &&
           state_measure(state, &answer->model, &answer->nrmse_percent, &answer->held_out_percent) &&
           reach_end(state, missing);
}
