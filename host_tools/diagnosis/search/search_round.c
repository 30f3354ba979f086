/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/search/search_round.h"
#include "diagnosis/answer/state.h"
#include "diagnosis/evidence/search.h"
#include "diagnosis/judgement/candidate_judgement.h"
#include "diagnosis/judgement/joined.h"
#include "diagnosis/judgement/no_physics.h"
#include "diagnosis/judgement/unseen.h"
#include "diagnosis/question/baseline.h"
#include "thresholds/thresholds.h"
#include <math.h>
#include <string.h>

static void name(const evidence_t *evidence, const candidates_t *found, finding_t *finding) {
    const candidate_t *best = &found->candidate[0];
    *finding = (finding_t){.block = best->block,
                           .t = best->test.t,
                           .t_blocks = best->test.t_blocks,
                           .margin = HUGE_VAL,
                           .certainty = NAMED};
    for (size_t i = 1; i < found->count; i++) {
        const candidate_t *rival = &found->candidate[i];
        if (rival->signature == NULL || rival->refused) {
            continue;
        }
        const double margin = search_margin(found, i);
        finding->margin = fmin(finding->margin, margin);
        if (margin < threshold.naming_margin && finding_add_rival(finding, rival->block)) {
            finding_at_most(finding, ISOLATED);
            if (!block_same_group(rival->block, best->block) &&
                fabs(evidence_cosine(evidence, best->signature, rival->signature)) < threshold.same_signature) {
                finding_at_most(finding, DETECTED);
            }
        }
    }
}

/* Takes the candidate into the chain if the held-out samples support it. */
static bool accept(state_t *state, const candidate_t *candidate, finding_t *finding, bool *accepted) {
    answer_t *answer = &state->answer;
    const question_t *question = answer->question;
    const double share =
        fmin((double)question->samples.held / (double)question->samples.fitted, candidate->test.held_share);
    joint_power_t power;
    double ignored;
    model_t augmented;
    model_copy(&augmented, &candidate->model);
    *accepted = false;
    if (!joint_fit(&question->samples, &question->noise, &augmented, blocks_fitted(answer, &augmented), FIT_ITERATIONS,
                   &power, state->failure) ||
        !state_measure(state, &answer->model, &ignored, &finding->held_out_before_percent) ||
        !state_measure(state, &augmented, &ignored, &finding->held_out_after_percent)) {
        model_free(&augmented);
        return false;
    }
    const model_block_t *put = model_find(&augmented, candidate->block->name);
    if (no_physics(&question->samples, put)) {
        model_free(&augmented);
        return true;
    }
    finding->support = (double)question->samples.held * log(state->power.held / power.held);
    *accepted = finding->held_out_after_percent < finding->held_out_before_percent &&
                finding->support >
                    fmax(threshold.least_support,
                         fmin(threshold.least_support_part * share * candidate->likelihood, threshold.support_enough));
    if (*accepted) {
        state_take(state, &augmented, &power);
        findings_add(answer, finding);
        state->found_um = hypot(state->found_um, candidate_own_um(candidate));
        joined_take(state);
    } else {
        model_free(&augmented);
    }
    return true;
}

/* Keeps the best of a round for the outputs. */
static void remember(answer_t *answer, const candidates_t *found, outcome_t best) {
    enum { MOST = DIAGNOSIS_MOST_CONSIDERED / 10 };
    answer->rounds++;
    for (size_t i = 0; i < found->count && i < MOST && answer->considered < DIAGNOSIS_MOST_CONSIDERED; i++) {
        const candidate_t *c = &found->candidate[i];
        if (c->likelihood > 0.0) {
            answer->consideration[answer->considered++] =
                (considered_t){.block = c->block,
                               .round = answer->rounds,
                               .likelihood = c->likelihood,
                               .t = c->test.t,
                               .t_blocks = c->test.t_blocks,
                               .outcome = candidate_contradicted(c)           ? CONTRADICTED
                                          : c->refused                        ? NOT_SUPPORTED
                                          : i == 0 || best == NOT_SIGNIFICANT ? best
                                                                              : LESS_LIKELY};
        }
    }
}

/* The next one as the first. */
static void put_first(candidates_t *found, size_t index) {
    const candidate_t first = found->candidate[index];
    memmove(&found->candidate[1], &found->candidate[0], index * sizeof first);
    found->candidate[0] = first;
}

/* The best one; or, where the held-out samples refuse that, one that explains less: of two effects at once, the larger
 * alone may need numbers that hold nowhere else. */
static bool take_one(state_t *state, const evidence_t *evidence, ask_t question, candidates_t *found, bool *convinces,
                     bool *found_one) {
    enum { MOST_TRIED = 3 };
    bool good = true;
    *convinces = false;
    for (size_t i = 0; good && !*found_one && i < found->count && i < MOST_TRIED; i++) {
        finding_t finding;
        put_first(found, i);
        if (!candidate_convinces(state, evidence, found)) {
            break;
        }
        *convinces = true;
        name(evidence, found, &finding);
        finding.shape = question != ASK_EFFECTS;
        good = accept(state, &found->candidate[0], &finding, found_one);
        found->candidate[0].refused = good && !*found_one;
    }
    return good;
}

/* One more block of those that the question is about, or none. */
static bool find_among(state_t *state, evidence_t *evidence, ask_t question, bool *found_one) {
    answer_t *answer = &state->answer;
    const search_problem_t problem = {.evidence = evidence,
                                      .noise = &answer->question->noise,
                                      .baseline = &answer->model,
                                      .setting = &state->setting,
                                      .without = state->without,
                                      .richer = state->richer,
                                      .fitted_along = answer->refitted_block,
                                      .fitted_along_count = answer->refitted};
    candidates_t found;
    bool convinces;
    evidence_ask(evidence, question);
    search(&problem, &found);
    state_advance(state);
    answer->tested += found.tested;
    const bool good = take_one(state, evidence, question, &found, &convinces, found_one);
    remember(answer, &found, *found_one ? TAKEN : convinces ? LESS_LIKELY : NOT_SIGNIFICANT);
    if (!*found_one && question != ASK_ANYTHING) {
        unseen_note(answer, &found);
    }
    candidates_free(&found);
    return good;
}

bool search_round(state_t *state, bool *found_one) {
    answer_t *answer = &state->answer;
    evidence_t *evidence =
        evidence_open(&answer->model, &answer->question->samples, &answer->question->noise, state->failure);
    bool good = evidence != NULL;
    *found_one = false;
    state_advance(state);
    if (good) {
        answer->unseen_count = 0;
        state->setting.lines = baseline_lines(&answer->question->samples, evidence_residual(evidence), state->line_hz);
    }
    for (ask_t question = ASK_EFFECTS; good && !*found_one && question <= ASK_ANYTHING; question++) {
        if (question != ASK_ANYTHING || excess(answer, state->power.held) > threshold.worth_explaining) {
            good = find_among(state, evidence, question, found_one);
        }
    }
    evidence_close(evidence);
    return good;
}
