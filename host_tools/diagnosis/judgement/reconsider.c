/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/judgement/reconsider.h"
#include "diagnosis/answer/state.h"
#include "diagnosis/judgement/no_physics.h"
#include "thresholds/thresholds.h"
#include <math.h>

/* The model without a finding, fitted again. */
static bool fit_without(state_t *state, const finding_t *finding, model_t *without, joint_power_t *power) {
    const answer_t *answer = &state->answer;
    const question_t *question = answer->question;
    finding_left_out(answer, finding, without);
    state_advance(state);
    if (!joint_fit(&question->samples, &question->noise, without, blocks_fitted(answer, without), FIT_ITERATIONS, power,
                   state->failure)) {
        model_free(without);
        return false;
    }
    return true;
}

/* The finding goes, and its model with it. */
static void drop(state_t *state, size_t finding, outcome_t why, model_t *without, const joint_power_t *power) {
    answer_t *answer = &state->answer;
    finding_considered_gone(answer, answer->finding[finding].block, why);
    findings_remove(answer, finding);
    state_take(state, without, power);
}

bool reconsider_take_out(state_t *state, size_t finding, outcome_t why) {
    model_t without;
    joint_power_t power;
    const bool good = fit_without(state, &state->answer.finding[finding], &without, &power);
    if (good) {
        drop(state, finding, why, &without, &power);
    }
    return good;
}

bool reconsider_superfluous(state_t *state, double least_size, unsigned spared) {
    answer_t *answer = &state->answer;
    const question_t *question = answer->question;
    const double least = least_size * least_size * (double)question->samples.fitted;
    for (size_t f = answer->findings; f-- > 0 && answer->findings > 1;) {
        model_t without;
        joint_power_t power;
        if ((spared >> f & 1U) != 0) {
            continue;
        }
        if (!fit_without(state, &answer->finding[f], &without, &power)) {
            return false;
        }
        if ((double)question->samples.fitted * log(power.fitted / state->power.fitted) < least ||
            (double)question->samples.held * log(power.held / state->power.held) < threshold.least_support) {
            drop(state, f, SUPERFLUOUS, &without, &power);
        } else {
            model_free(&without);
        }
    }
    return true;
}

static bool finding_stands(const answer_t *answer, const finding_t *finding) {
    return finding_determined(answer, finding) &&
           !no_physics(&answer->question->samples, &answer->model.block[finding_index(answer, finding)]);
}

bool reconsider_undetermined(state_t *state) {
    answer_t *answer = &state->answer;
    bool settled = false;
    while (!settled) {
        size_t f = answer->findings;
        if (!findings_errors(answer, state->failure)) {
            return false;
        }
        while (f > 0 && finding_stands(answer, &answer->finding[f - 1])) {
            f--;
        }
        settled = f == 0;
        if (!settled && !reconsider_take_out(state, f - 1, SUPERFLUOUS)) {
            return false;
        }
    }
    return true;
}
