/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/judgement/candidate_judgement.h"
#include "diagnosis/noise/remainder.h"
#include "thresholds/thresholds.h"
#include <gsl/gsl_cdf.h>
#include <math.h>
#include <stdlib.h>

/* What the look has seen ring, but for a chance of false_ring. It may ring once, in one block of time, and in a
 * thousandth of the samples: how it scatters from block to block, and how much of all samples it is, says nothing. */
static bool is_seen(const state_t *state, const candidate_t *candidate) {
    double value[BLOCK_MAX_PARAMETERS];
    candidate_value(&candidate->model.block[candidate->at], value);
    return candidate->block->probe->rings != NULL && candidate->block->probe->rings(&state->setting.seen, value);
}

/* Significant by both standard errors, corrected for the number of signatures tried. */
static bool significant(const state_t *state, const candidate_t *candidate, size_t tested) {
    const double z = gsl_cdf_ugaussian_Qinv(0.5 * threshold.false_alarm / (double)tested);
    const double z_blocks = gsl_cdf_tdist_Qinv(0.5 * threshold.false_alarm_blocks / (double)tested, 20.0);
    const evidence_test_t *test = &candidate->test;
    return fabs(test->t) > z && (fabs(test->t_blocks) > z_blocks || is_seen(state, candidate)) &&
           test->amplitude > 1.0 / threshold.amplitude_ratio && test->amplitude < threshold.amplitude_ratio;
}

/* By what it takes out of the residual together with a hysteresis that is far from linear in its numbers. */
static bool jointly_significant(const state_t *state, const candidate_t *candidate, size_t tested) {
    const double z = gsl_cdf_ugaussian_Qinv(0.5 * threshold.false_alarm / (double)tested);
    return candidate->joint && hysteresis_far_from_linear(&candidate->model) &&
           (double)state->answer.question->samples.fitted * log(state->power.fitted / candidate->power.fitted) > z * z;
}

/* What the blocks that were found change: a column. NULL: the chain does not run without them. */
static double *change_found(const state_t *state) {
    const answer_t *answer = &state->answer;
    model_t without;
    failure_t refusal;
    model_copy(&without, &answer->model);
    for (size_t b = without.blocks; b-- > 0;) {
        if ((blocks_found(answer, &answer->model) >> b & 1U) != 0) {
            model_remove(&without, b);
        }
    }
    double *change = samples_change(&answer->question->samples, &answer->model, &without, &refusal);
    model_free(&without);
    return change;
}

/* Beyond the nuisance subspace. Where it acts, it has to be more than the error of what was found may be. */
static bool large_enough(const state_t *state, const evidence_t *evidence, const candidate_t *candidate) {
    const answer_t *answer = &state->answer;
    const double least_um = (state->answer.question->coarse ? threshold.least_size_of_steps : threshold.least_size) *
                            answer->question->noise.sigma_um;
    bool large = candidate_own_um(candidate) > least_um || is_seen(state, candidate);
    if (large && answer->findings > 0 && !is_seen(state, candidate)) {
        double *found = change_found(state);
        large = found != NULL && evidence_beside(evidence, candidate->signature, candidate->test.amplitude, found,
                                                 threshold.wrong_at_a_sample) > least_um;
        free(found);
    }
    return large;
}

/* Of what it takes out of the residual together with the hysteresis' numbers. */
static double joint_size_um(const state_t *state, const candidate_t *candidate) {
    const double fall = state->power.fitted - candidate->power.fitted;
    return candidate->joint ? sqrt(fmax(0.0, fall) / (double)state->answer.question->samples.fitted) : 0.0;
}

bool candidate_contradicted(const candidate_t *candidate) {
    return candidate->electrical < -threshold.naming_margin;
}

/* Where the model's own numbers are so few that other shapes imitate what it lacks: whether the block explains most of
 * it. */
static bool explains_most(const state_t *state, const candidate_t *candidate) {
    const double before = excess(&state->answer, state->power.held);
    return candidate->joint && excess(&state->answer, candidate->power.held) <
                                   fmax((1.0 - threshold.shape_explains) * before, threshold.shape_leaves);
}

/* Where the noise is known, others judge that. */
static bool explains_much(const state_t *state, const candidate_t *candidate) {
    const answer_t *answer = &state->answer;
    const question_t *question = answer->question;
    return remainder_knows_noise(&question->samples, &question->noise) ||
           (candidate->joint && candidate->power.fitted < (1.0 - threshold.much_of_it) * state->power.fitted);
}

/* Whether it is large enough for a finding. A shape has to explain most of what is left: part of it any shape does. */
static bool worth_telling(const state_t *state, const evidence_t *evidence, const candidate_t *candidate) {
    const ask_t question = evidence_question(evidence);
    bool large = question == ASK_ANYTHING && !state->answer.question->coarse
                     ? joint_size_um(state, candidate) > threshold.least_part_of_found * state->found_um
                     : large_enough(state, evidence, candidate);
    large = large &&
            (!state->answer.question->coarse || question == ASK_EFFECTS ||
             joint_size_um(state, candidate) > threshold.least_size_of_shapes * state->answer.question->noise.sigma_um);
    return large && explains_much(state, candidate) && (question == ASK_EFFECTS || explains_most(state, candidate));
}

bool candidate_convinces(const state_t *state, const evidence_t *evidence, const candidates_t *found) {
    const candidate_t *best = &found->candidate[0];
    return !candidate_contradicted(best) &&
           (significant(state, best, found->tested) ||
            (evidence_question(evidence) == ASK_ANYTHING && jointly_significant(state, best, found->tested))) &&
           worth_telling(state, evidence, best);
}
