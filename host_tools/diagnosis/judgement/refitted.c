/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/judgement/refitted.h"
#include "diagnosis/answer/state.h"
#include "diagnosis/evidence/joint_fit.h"
#include "diagnosis/evidence/searched.h"

void refitted_choose(answer_t *answer, const model_t *given) {
    const question_t *question = answer->question;
    model_t model;
    failure_t singular;
    unsigned blocks = 0;
    answer->refitted = 0;
    model_copy(&model, given);
    for (size_t b = 0; b < model.blocks; b++) {
        blocks |= model.block[b].block->probe != NULL ? 1U << b : 0U;
    }
    if (blocks != 0 && joint_errors(&question->samples, &question->noise, &model, blocks, &singular)) {
        for (size_t b = 0; b < model.blocks; b++) {
            if ((blocks >> b & 1U) != 0 && block_determined(&model.block[b])) {
                answer->refitted_block[answer->refitted++] = model.block[b].block;
            }
        }
    }
    model_free(&model);
}
