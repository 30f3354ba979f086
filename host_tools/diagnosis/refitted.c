/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/refitted.h"
#include "diagnosis/evidence/joint_fit.h"
#include "diagnosis/evidence/searched.h"
#include "diagnosis/findings.h"
#include <math.h>

void refitted_choose(diagnosis_t *diagnosis, const model_t *given) {
    model_t model;
    failure_t singular;
    unsigned blocks = 0;
    diagnosis->refitted = 0;
    model_copy(&model, given);
    for (size_t b = 0; b < model.blocks; b++) {
        blocks |= model.block[b].block->probe != NULL ? 1U << b : 0U;
    }
    if (blocks != 0 && joint_errors(&diagnosis->samples, &diagnosis->noise, &model, blocks, &singular)) {
        for (size_t b = 0; b < model.blocks; b++) {
            if ((blocks >> b & 1U) != 0 && block_determined(&model.block[b])) {
                diagnosis->refitted_block[diagnosis->refitted++] = model.block[b].block;
            }
        }
    }
    model_free(&model);
}

bool refitted_changed(const model_block_t *given, const model_block_t *fitted, size_t parameter) {
    const parameter_t *was = &given->parameter[parameter], *is = &fitted->parameter[parameter];
    return is_searched(given->block, parameter) && is->sigma != NULL &&
           fabs(is->value[0] - was->value[0]) > 2.0 * is->sigma[0];
}

unsigned refitted_blocks(const diagnosis_t *diagnosis, const model_t *model) {
    return joint_blocks(model, diagnosis->refitted_block, diagnosis->refitted);
}
