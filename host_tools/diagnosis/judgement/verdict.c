/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/judgement/verdict.h"
#include "diagnosis/answer/state.h"
#include "diagnosis/nuisance/past.h"
#include "thresholds/thresholds.h"
#include <math.h>
#include <stdlib.h>

/* A curve of few numbers takes most of any other curve. If nothing else was found, and what it leaves goes with the
 * position, it is another one. */
static bool is_another_curve(const answer_t *answer) {
    size_t curves = 0, others = 0;
    for (size_t f = 0; f < answer->findings; f++) {
        curves += answer->finding[f].shape ? 1 : 0;
        others += answer->finding[f].shape || answer->finding[f].in_readings ? 0 : 1;
    }
    return curves > 0 && others == 0 && answer->remainder.at_levels;
}

/* missing, and what is left now, are beyond the noise; where that is not known, all of them counts. */
static bool comes_near_only(const state_t *state, double missing) {
    const answer_t *answer = &state->answer;
    const question_t *question = answer->question;
    const double noise = remainder_knows_noise(&question->samples, &question->noise) ? 0.0 : 1.0;
    return blocks_found(answer, &answer->model) != 0 &&
           (is_another_curve(answer) ||
            excess(answer, state->power.held) + noise > threshold.leaves_too_much * (missing + noise));
}

/* Where more than noise remains, what that is may be in the place of any finding: no name is without reservation. */
static void reserve(answer_t *answer, certainty_t at_most) {
    for (size_t f = 0; f < answer->findings; f++) {
        if (!answer->finding[f].in_readings) {
            finding_at_most(&answer->finding[f], at_most);
        }
    }
}

static void judge(state_t *state, double missing) {
    answer_t *answer = &state->answer;
    for (size_t f = 0; f < answer->findings; f++) {
        answer->finding[f].settled = answer->finding[f].certainty;
    }
    if (!answer->remainder.structured) {
        answer->verdict = answer->findings == 0 ? NOTHING_MISSING : EXPLAINED;
    } else if (answer->findings > 0 && !comes_near_only(state, missing)) {
        answer->verdict = PARTLY_EXPLAINED;
        reserve(answer, ISOLATED);
    } else {
        answer->verdict = UNKNOWN_PHYSICS;
        reserve(answer, DETECTED);
    }
}

bool verdict_look(state_t *state) {
    answer_t *answer = &state->answer;
    const question_t *question = answer->question;
    double *simulated = samples_column(&question->samples);
    model_t smooth;
    model_copy(&smooth, &answer->model);
    model_without_noise(&smooth);
    double *change = samples_change(&question->samples, &smooth, &answer->baseline, state->failure);
    const bool good =
        change != NULL && past_simulate(&question->samples, &question->noise, &smooth, simulated, state->failure);
    if (good) {
        answer->remainder = remainder_of(&question->samples, &question->noise, simulated, change,
                                         state->answer.question->step_um / sqrt(12.0));
    }
    model_free(&smooth);
    free(simulated);
    free(change);
    return good;
}

bool verdict_reach(state_t *state, double missing) {
    const bool good = verdict_look(state);
    if (good) {
        judge(state, missing);
    }
    return good;
}
