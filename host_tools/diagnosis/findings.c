/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "findings.h"
#include "refine.h"
#include <math.h>
#include <stdlib.h>

/* refine counts all samples; of three, one was held out of the fit. */
static const double samples_over_fitted = 1.5;
/* Standard errors that a number has to be away from nothing, and the largest one of a number that has no nothing (a
 * frequency, a time), in parts of itself. */
static const double least_deviations = 3.0, least_precision = 1.0 / 3.0;

bool finding_searched(const finding_t *finding, size_t parameter) {
    return (finding->block->probe->searched >> parameter & 1U) != 0;
}

const finding_t *finding_of(const diagnosis_t *diagnosis, const block_t *block) {
    for (size_t f = 0; f < diagnosis->findings; f++) {
        if (diagnosis->finding[f].block == block) {
            return &diagnosis->finding[f];
        }
    }
    return NULL;
}

size_t finding_index(const diagnosis_t *diagnosis, const finding_t *finding) {
    size_t index = 0;
    while (diagnosis->model.block[index].block != finding->block) {
        index++;
    }
    return index;
}

/* What was fitted or searched: numbers of the hysteresis that are not chosen, and the findings' searched ones. A number
 * of an array that is exactly 0 rests on its bound. */
static bool was_found(const diagnosis_t *d, const model_block_t *block, size_t p, size_t element) {
    const parameter_info_t *info = &block->block->parameter[p];
    if (block_is_hysteresis(block->block)) {
        const bool idle = info->optional && !info->array && block->parameter[p].value[0] == info->default_value;
        return !info->chosen && !idle && !(info->array && block->parameter[p].value[element] == 0.0);
    }
    const finding_t *finding = finding_of(d, block->block);
    return finding != NULL && finding_searched(finding, p) && !finding->in_readings;
}

static size_t list_found(const model_t *model, const diagnosis_t *d, refine_unknown_t *unknown) {
    size_t count = 0;
    for (size_t b = 0; b < model->blocks; b++) {
        for (size_t p = 0; p < model->block[b].block->parameters; p++) {
            for (size_t e = 0; e < model->block[b].parameter[p].count; e++) {
                if (was_found(d, &model->block[b], p, e)) {
                    if (unknown != NULL) {
                        unknown[count] = refine_unknown_at(model, b, p, e);
                    }
                    count++;
                }
            }
        }
    }
    return count;
}

/* Errors that the baseline came with are not those of this fit. */
static void forget_errors(model_t *model, const diagnosis_t *d) {
    for (size_t b = 0; b < model->blocks; b++) {
        for (size_t p = 0; p < model->block[b].block->parameters; p++) {
            parameter_t *parameter = &model->block[b].parameter[p];
            bool any = block_is_hysteresis(model->block[b].block);
            for (size_t e = 0; e < parameter->count; e++) {
                any = any || was_found(d, &model->block[b], p, e);
            }
            if (any) {
                free(parameter->sigma);
                parameter->sigma = NULL;
            }
        }
    }
}

/* A block is an approximation: its numbers are not better than it is. */
static void widen(diagnosis_t *d) {
    for (size_t f = 0; f < d->findings; f++) {
        const model_block_t *block = &d->model.block[finding_index(d, &d->finding[f])];
        for (size_t p = 0; p < block->block->parameters; p++) {
            const parameter_t *parameter = &block->parameter[p];
            if (finding_searched(&d->finding[f], p) && parameter->sigma != NULL && parameter->sigma[0] > 0.0) {
                parameter->sigma[0] = hypot(parameter->sigma[0], block->block->probe->accuracy * parameter->value[0]);
            }
        }
    }
}

bool findings_errors(diagnosis_t *diagnosis, failure_t *failure) {
    model_t *model = &diagnosis->model;
    forget_errors(model, diagnosis);
    const size_t unknowns = list_found(model, diagnosis, NULL);
    refine_unknown_t *unknown = allocate(unknowns + 1, sizeof *unknown);
    const refine_job_t errors = {.recordings = diagnosis->samples.recordings,
                                 .count = diagnosis->samples.count,
                                 .from = diagnosis->samples.from,
                                 .unknown = unknown,
                                 .unknowns = list_found(model, diagnosis, unknown)};
    refine_report_t report;
    bool good = true;
    if (unknowns > 0) {
        good = refine(model, &errors, &report, failure);
        for (size_t u = 0; good && u < unknowns; u++) {
            report.sigma[u] *= sqrt(samples_over_fitted);
        }
        if (good) {
            refine_keep_errors(model, &errors, &report);
            widen(diagnosis);
            refine_report_free(&report);
        }
    }
    free(unknown);
    return good;
}

bool finding_determined(const diagnosis_t *diagnosis, const finding_t *finding) {
    const model_block_t *block = &diagnosis->model.block[finding_index(diagnosis, finding)];
    for (size_t p = 0; p < block->block->parameters; p++) {
        const parameter_t *parameter = &block->parameter[p];
        if (finding_searched(finding, p) && parameter->sigma != NULL) {
            const double value = fabs(parameter->value[0]), sigma = parameter->sigma[0];
            const double most = block->block->parameter[p].proportional ? 1.0 / least_deviations : least_precision;
            if (sigma < most * value) {
                return true;
            }
        }
    }
    return false;
}
