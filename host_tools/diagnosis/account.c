/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "account.h"
#include "fit_ranges.h"
#include "hysteresis_refit.h"
#include "json_output.h"
#include "refine.h"
#include <math.h>
#include <stdlib.h>

/* Below these, likelihoods are halved by chance alone: see the header. */
static const double support_scale = 5.0, margin_scale = 9.1, never_certain = 0.99;
/* refine counts all samples; of three, one was held out of the fit. */
static const double samples_over_fitted = 1.5;

double finding_confidence(const finding_t *finding) {
    const double there = -expm1(-fmax(0.0, finding->support) / support_scale);
    const double this_one = 1.0 / (1.0 + exp(-fmax(0.0, finding->margin) / margin_scale));
    return fmin(never_certain, there * this_one * (finding->certainty == DETECTED ? 0.5 : 1.0));
}

bool something_remains(const diagnosis_t *diagnosis) {
    return diagnosis->remainder.structured;
}

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

typedef struct {
    diagnosis_t *diagnosis;
    const recording_t *recordings;
    size_t count;
    account_t *account;
    double **difference; /* room for one a recording */
} job_t;

static bool locate_finding(job_t *job, const finding_t *finding, location_t *where, failure_t *failure) {
    model_t without;
    bool good;
    model_copy(&without, &job->diagnosis->model);
    model_remove(&without, finding_index(job->diagnosis, finding));
    good = hysteresis_refit(&without, job->recordings, job->count, failure);
    for (size_t i = 0; good && i < job->count; i++) {
        good = chain_simulate(&without, &job->recordings[i], 0, job->difference[i], failure);
        for (size_t k = 0; k < job->recordings[i].samples; k++) {
            job->difference[i][k] = job->account->after[i][k] - job->difference[i][k];
        }
    }
    if (good) {
        locate(job->recordings, job->count, job->difference, job->account->from, 0.0, where);
    }
    model_free(&without);
    return good;
}

static void locate_remaining(job_t *job, location_t *where) {
    double range[2];
    recordings_range(job->recordings, job->count, COLUMN_DISPLACEMENT, range);
    const double floor_um = 0.01 * job->diagnosis->noise_percent * (range[1] - range[0]);
    for (size_t i = 0; i < job->count; i++) {
        for (size_t k = 0; k < job->recordings[i].samples; k++) {
            job->difference[i][k] = job->recordings[i].column[COLUMN_DISPLACEMENT][k] - job->account->after[i][k];
        }
    }
    locate(job->recordings, job->count, job->difference, job->account->from, floor_um, where);
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
    return finding != NULL && finding_searched(finding, p);
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

static bool find_errors(job_t *job, failure_t *failure) {
    model_t *model = &job->diagnosis->model;
    forget_errors(model, job->diagnosis);
    const size_t unknowns = list_found(model, job->diagnosis, NULL);
    refine_unknown_t *unknown = allocate(unknowns + 1, sizeof *unknown);
    const refine_job_t errors = {.recordings = job->recordings,
                                 .count = job->count,
                                 .from = job->account->from,
                                 .unknown = unknown,
                                 .unknowns = list_found(model, job->diagnosis, unknown)};
    refine_report_t report;
    bool good = true;
    if (unknowns > 0) {
        good = refine(model, &errors, &report, failure);
        for (size_t u = 0; good && u < unknowns; u++) {
            report.sigma[u] *= sqrt(samples_over_fitted);
        }
        if (good) {
            refine_keep_errors(model, &errors, &report);
            refine_report_free(&report);
        }
    }
    free(unknown);
    return good;
}

static void describe_fit(const job_t *job) {
    const diagnosis_t *d = job->diagnosis;
    json_t *list = json_array(), *found = json_array(), *family = json_object_get(d->model.fit, "family");
    for (size_t i = 0; i < job->count; i++) {
        const recording_t *r = &job->recordings[i];
        json_array_append_new(list, json_pack("{s:s, s:f}", "name", r->name, "memory_determined_from_s",
                                              r->start_s + (double)job->account->from[i] / r->sample_rate_hz));
    }
    for (size_t f = 0; f < d->findings; f++) {
        json_array_append_new(found, json_string(d->finding[f].block->name));
    }
    json_t *fit = json_pack("{s:o, s:o, s:o, s:o}", "nrmse_percent", json_number_or_null(d->nrmse_percent),
                            "held_out_nrmse_percent", json_number_or_null(d->held_out_percent), "recordings", list,
                            "found_by_diagnosis", found);
    if (family != NULL) {
        json_object_set(fit, "family", family);
    }
    fit_ranges_set(fit, job->recordings, job->count, &d->model); /* where these say nothing the hysteresis stayed */
    json_decref(d->model.fit);
    job->diagnosis->model.fit = fit;
}

bool account_for(diagnosis_t *diagnosis, const recording_t *recordings, size_t count, account_t *account,
                 failure_t *failure) {
    job_t job = {.diagnosis = diagnosis,
                 .recordings = recordings,
                 .count = count,
                 .account = account,
                 .difference = recordings_room(recordings, count)};
    bool good = true;
    *account = (account_t){.before = recordings_room(recordings, count),
                           .after = recordings_room(recordings, count),
                           .from = allocate(count, sizeof(size_t)),
                           .recordings = count};
    for (size_t i = 0; good && i < count; i++) {
        account->from[i] = first_that_counts(&diagnosis->model, &recordings[i]);
        good = chain_simulate(&diagnosis->baseline, &recordings[i], 0, account->before[i], failure) &&
               chain_simulate(&diagnosis->model, &recordings[i], 0, account->after[i], failure);
    }
    for (size_t f = 0; good && f < diagnosis->findings; f++) {
        account->confidence[f] = finding_confidence(&diagnosis->finding[f]);
        good = locate_finding(&job, &diagnosis->finding[f], &account->where[f], failure);
    }
    if (good && something_remains(diagnosis)) {
        locate_remaining(&job, &account->remaining);
    }
    good = good && find_errors(&job, failure);
    recordings_room_free(job.difference, count);
    if (good) {
        describe_fit(&job);
    } else {
        account_free(account);
    }
    return good;
}

void account_free(account_t *account) {
    recordings_room_free(account->before, account->recordings);
    recordings_room_free(account->after, account->recordings);
    free(account->from);
}
