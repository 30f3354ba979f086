/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/account/instead.h"
#include "diagnosis/answer/state.h"
#include "diagnosis/evidence/candidate.h"
#include "diagnosis/question/question.h"
#include "diagnosis/search/contest.h"

void instead_of_terms(const answer_t *answer, model_t *model) {
    model_copy(model, &answer->model);
    for (size_t b = model->blocks; b-- > 0;) {
        const finding_t *finding = finding_of(answer, model->block[b].block);
        if (finding != NULL && finding_is_empirical(finding)) {
            model_remove(model, b);
        }
    }
}

bool instead_of_finding(const answer_t *answer, const finding_t *finding, const block_t *rival, model_t *model) {
    const question_t *question = answer->question;
    model_t without;
    contest_winner_t fitted;
    probe_setting_t setting;
    joint_power_t power;
    failure_t refusal;
    instead_of_terms(answer, &without);
    model_without_noise(&without);
    model_remove_block(&without, finding->block);
    question_setting(question->recordings, question->samples.count, &setting);
    const bool good = contest_fit(&question->samples, &setting, &without, rival, &fitted);
    if (good) {
        (void)joint_fit(&question->samples, &question->noise, &fitted.model, blocks_fitted(answer, &fitted.model),
                        FIT_ITERATIONS, &power, &refusal);
        *model = fitted.model;
    }
    model_free(&without);
    return good;
}

double instead_of_nothing(const model_t *chain, const unseen_t *unseen, double limits, model_t *model) {
    double value[BLOCK_MAX_PARAMETERS];
    for (size_t p = 0; p < unseen->block->parameters; p++) {
        value[p] = unseen->form[p] * (candidate_proportional(unseen->block, p) ? limits : 1.0);
    }
    (void)candidate_insert(model, chain, unseen->block, value);
    return value[unseen->parameter];
}
