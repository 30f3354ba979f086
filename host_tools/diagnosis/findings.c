/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/findings.h"
#include "diagnosis/evidence/joint_fit.h"
#include "diagnosis/evidence/searched.h"
#include "diagnosis/refitted.h"
#include "thresholds/thresholds.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

bool finding_is_empirical(const finding_t *finding) {
    return finding->block->empirical != NULL;
}

size_t findings_named(const diagnosis_t *diagnosis) {
    size_t named = 0;
    while (named < diagnosis->findings && !finding_is_empirical(&diagnosis->finding[named])) {
        named++;
    }
    return named;
}

double findings_named_held_out_percent(const diagnosis_t *diagnosis) {
    const size_t named = findings_named(diagnosis);
    return named < diagnosis->findings ? diagnosis->finding[named].held_out_before_percent
                                       : diagnosis->held_out_percent;
}

bool finding_searched(const finding_t *finding, size_t parameter) {
    return is_searched(finding->block, parameter);
}

bool finding_tells(const finding_t *finding, size_t parameter) {
    const parameter_info_t *info = &finding->block->parameter[parameter];
    return finding_searched(finding, parameter) || info->center_of != NULL || info->half_of != NULL ||
           (finding_is_empirical(finding) && info->chosen);
}

const finding_t *finding_of(const diagnosis_t *diagnosis, const block_t *block) {
    for (size_t f = 0; f < diagnosis->findings; f++) {
        if (diagnosis->finding[f].block == block) {
            return &diagnosis->finding[f];
        }
    }
    return NULL;
}

bool finding_may_be(const diagnosis_t *diagnosis, const block_t *block) {
    for (size_t f = 0; f < diagnosis->findings; f++) {
        if (finding_has_rival(&diagnosis->finding[f], block)) {
            return true;
        }
    }
    return finding_of(diagnosis, block) != NULL;
}

size_t finding_index(const diagnosis_t *diagnosis, const finding_t *finding) {
    size_t index = 0;
    while (diagnosis->model.block[index].block != finding->block) {
        index++;
    }
    return index;
}

void finding_left_out(const diagnosis_t *diagnosis, const finding_t *finding, model_t *without) {
    model_copy(without, &diagnosis->model);
    model_remove(without, finding_index(diagnosis, finding));
}

void finding_considered_gone(diagnosis_t *diagnosis, const block_t *block, outcome_t why) {
    for (size_t c = 0; c < diagnosis->considered; c++) {
        considered_t *considered = &diagnosis->consideration[c];
        if (considered->block == block && considered->outcome == TAKEN) {
            considered->outcome = why;
        }
    }
}

void finding_considered_taken(diagnosis_t *diagnosis, const block_t *block) {
    for (size_t c = diagnosis->considered; c-- > 0;) {
        if (diagnosis->consideration[c].block == block) {
            diagnosis->consideration[c].outcome = TAKEN;
            return;
        }
    }
}

void findings_insert(diagnosis_t *diagnosis, size_t index, const finding_t *finding) {
    memmove(&diagnosis->finding[index + 1], &diagnosis->finding[index],
            (diagnosis->findings - index) * sizeof *finding);
    diagnosis->finding[index] = *finding;
    diagnosis->findings++;
}

void findings_add(diagnosis_t *diagnosis, const finding_t *finding) {
    findings_insert(diagnosis, diagnosis->findings, finding);
}

void findings_remove(diagnosis_t *diagnosis, size_t index) {
    diagnosis->findings--;
    memmove(&diagnosis->finding[index], &diagnosis->finding[index + 1],
            (diagnosis->findings - index) * sizeof diagnosis->finding[0]);
}

void finding_rename(diagnosis_t *diagnosis, finding_t *finding, const block_t *block, outcome_t why) {
    if (block != finding->block) {
        finding_considered_gone(diagnosis, finding->block, why);
        finding_considered_taken(diagnosis, block);
        finding->block = block;
    }
}

bool finding_has_rival(const finding_t *finding, const block_t *rival) {
    for (size_t r = 0; r < finding->rivals; r++) {
        if (finding->rival[r] == rival) {
            return true;
        }
    }
    return false;
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

/* A block is an approximation: its numbers are not better than it is. */
static void widen(diagnosis_t *d) {
    for (size_t f = 0; f < d->findings; f++) {
        const model_block_t *block = &d->model.block[finding_index(d, &d->finding[f])];
        for (size_t p = 0; p < block->block->parameters; p++) {
            const parameter_t *parameter = &block->parameter[p];
            if (finding_searched(&d->finding[f], p) && parameter->sigma != NULL && parameter->sigma[0] > 0.0) {
                parameter->sigma[0] =
                    hypot(parameter->sigma[0], accuracy_of(block_search(block->block), p) * parameter->value[0]);
            }
        }
    }
}

bool findings_errors(diagnosis_t *diagnosis, failure_t *failure) {
    unsigned blocks = refitted_blocks(diagnosis, &diagnosis->model);
    for (size_t f = 0; f < diagnosis->findings; f++) {
        blocks |= diagnosis->finding[f].in_readings ? 0U : 1U << finding_index(diagnosis, &diagnosis->finding[f]);
    }
    forget_errors(&diagnosis->model, blocks);
    if (!joint_errors(&diagnosis->samples, &diagnosis->noise, &diagnosis->model, blocks, failure)) {
        return false;
    }
    widen(diagnosis);
    return true;
}

bool finding_times(const diagnosis_t *diagnosis, const finding_t *finding, double time_s[2]) {
    const probe_t *probe = finding->block->probe;
    if (probe == NULL || probe->times.from_s == NULL) {
        return false;
    }
    const model_block_t *block = &diagnosis->model.block[finding_index(diagnosis, finding)];
    const double fastest_s = 2.0 / diagnosis->samples.recordings[0].sample_rate_hz;
    time_s[0] = fmax(fastest_s, *model_parameter(block, probe->times.from_s)->value);
    time_s[1] = fmin(samples_longest_s(&diagnosis->samples), *model_parameter(block, probe->times.to_s)->value);
    return time_s[0] < time_s[1];
}

bool block_determined(const model_block_t *block) {
    for (size_t p = 0; p < block->block->parameters; p++) {
        const parameter_t *parameter = &block->parameter[p];
        if (is_searched(block->block, p) && parameter->sigma != NULL) {
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

bool finding_determined(const diagnosis_t *diagnosis, const finding_t *finding) {
    return block_determined(&diagnosis->model.block[finding_index(diagnosis, finding)]);
}
