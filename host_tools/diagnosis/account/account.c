/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/account/account.h"
#include "base/json_output.h"
#include "chain/fit_ranges.h"
#include "diagnosis/answer/state.h"
#include "diagnosis/nuisance/past.h"
#include "thresholds/thresholds.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

bool finding_has_reservation(const finding_t *finding) {
    return finding->certainty == ISOLATED && finding->rivals == 0;
}

double finding_confidence(const finding_t *finding) {
    const double right[] = {[DETECTED] = threshold.detected_are_right,
                            [ISOLATED] = threshold.isolated_are_right,
                            [NAMED] = threshold.named_are_right};
    const double there = -expm1(-fmax(0.0, finding->support) / threshold.support_scale);
    return there * (finding->in_readings ? threshold.never_certain : right[finding->certainty]);
}

bool something_remains(const answer_t *answer) {
    return answer->remainder.structured;
}

typedef struct {
    answer_t *answer;
    const recording_t *recordings;
    size_t count;
    account_t *account;
    double **difference; /* room for one a recording */
} job_t;

/* Into a room: the simulation of each recording, with what an unknown past left. */
static bool simulate(const answer_t *answer, const model_t *model, double **room, failure_t *failure) {
    const samples_t *samples = &answer->question->samples;
    double *column = samples_column(samples);
    const bool good = past_simulate(samples, &answer->question->noise, model, column, failure);
    for (size_t i = 0; good && i < samples->count; i++) {
        memcpy(room[i], column + samples->begin[i], samples->recordings[i].samples * sizeof(double));
    }
    free(column);
    return good;
}

/* The chain without what is no response to a drive. Rounding of two simulations hides what differs between them. */
static bool simulate_smooth(const job_t *job, const model_t *model, double **room, failure_t *failure) {
    model_t smooth;
    model_copy(&smooth, model);
    model_without_noise(&smooth);
    const bool good = simulate(job->answer, &smooth, room, failure);
    model_free(&smooth);
    return good;
}

static bool simulate_without(job_t *job, const finding_t *finding, failure_t *failure) {
    model_t without;
    joint_power_t ignored;
    finding_left_out(job->answer, finding, &without);
    model_without_noise(&without);
    const bool good =
        joint_fit(&job->answer->question->samples, &job->answer->question->noise, &without, 0, 1, &ignored, failure) &&
        simulate(job->answer, &without, job->difference, failure);
    model_free(&without);
    return good;
}

static bool locate_finding(job_t *job, const finding_t *finding, location_t *where, double **share,
                           failure_t *failure) {
    const bool good = finding->in_readings ? simulate(job->answer, &job->answer->model, job->difference, failure)
                                           : simulate_without(job, finding, failure);
    for (size_t i = 0; good && i < job->count; i++) {
        for (size_t k = 0; k < job->recordings[i].samples; k++) {
            job->difference[i][k] = job->account->after[i][k] - job->difference[i][k];
        }
    }
    if (good) {
        locate(job->recordings, job->count, job->difference, job->account->from, 0.0, where);
        for (size_t i = 0; i < job->count; i++) {
            memcpy(share[i], job->difference[i], job->recordings[i].samples * sizeof(double));
        }
    }
    return good;
}

static void locate_remaining(job_t *job, location_t *where) {
    for (size_t i = 0; i < job->count; i++) {
        for (size_t k = 0; k < job->recordings[i].samples; k++) {
            job->difference[i][k] = job->recordings[i].column[COLUMN_DISPLACEMENT][k] - job->account->after[i][k];
        }
    }
    locate(job->recordings, job->count, job->difference, job->account->from, job->answer->question->noise.rms_um,
           where);
}

static void describe_fit(const job_t *job) {
    const answer_t *answer = job->answer;
    json_t *list = json_array(), *found = json_array(), *family = json_object_get(answer->model.fit, "family");
    for (size_t i = 0; i < job->count; i++) {
        const recording_t *r = &job->recordings[i];
        json_array_append_new(list, json_pack("{s:s, s:f}", "name", r->name, "memory_determined_from_s",
                                              r->start_s + (double)job->account->from[i] / r->sample_rate_hz));
    }
    for (size_t f = 0; f < answer->findings; f++) {
        json_array_append_new(found, json_string(answer->finding[f].block->name));
    }
    json_t *fit = json_pack("{s:o, s:o, s:o, s:o}", "nrmse_percent", json_number_or_null(answer->nrmse_percent),
                            "held_out_nrmse_percent", json_number_or_null(answer->held_out_percent), "recordings", list,
                            "found_by_diagnosis", found);
    if (family != NULL) {
        json_object_set(fit, "family", family);
    }
    fit_ranges_set(fit, job->recordings, job->count,
                   &answer->model); /* where these say nothing the hysteresis stayed */
    json_decref(answer->model.fit);
    job->answer->model.fit = fit;
}

bool account_for(answer_t *answer, const recording_t *recordings, size_t count, account_t *account,
                 failure_t *failure) {
    job_t job = {.answer = answer,
                 .recordings = recordings,
                 .count = count,
                 .account = account,
                 .difference = recordings_room(recordings, count)};
    *account = (account_t){.before = recordings_room(recordings, count),
                           .after = recordings_room(recordings, count),
                           .from = allocate(count, sizeof(size_t)),
                           .recordings = count};
    memcpy(account->from, answer->question->samples.from, count * sizeof(size_t));
    bool good = simulate(answer, &answer->baseline, account->before, failure) &&
                simulate_smooth(&job, &answer->model, account->after, failure);
    account->taken_out = good ? taken_out_of(answer, failure) : NULL;
    good = account->taken_out != NULL;
    for (size_t f = 0; good && f < answer->findings; f++) {
        account->share[f] = recordings_room(recordings, count);
        good = locate_finding(&job, &answer->finding[f], &account->where[f], account->share[f], failure);
    }
    if (good && (something_remains(answer) || answer->another_shape)) {
        locate_remaining(&job, &account->remaining);
    }
    recordings_room_free(job.difference, count);
    good = good && measured_columns(answer, &account->measured, failure);
    for (size_t f = 0; good && f < answer->findings; f++) {
        finding_t *finding = &answer->finding[f];
        if (finding_contradicted(finding, &account->measured.finding[f])) {
            finding_at_most(finding, DETECTED);
        }
        account->confidence[f] = finding_confidence(finding);
    }
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
    for (size_t f = 0; f < DIAGNOSIS_MOST_FINDINGS && account->share[f] != NULL; f++) {
        recordings_room_free(account->share[f], account->recordings);
    }
    free(account->from);
    free(account->taken_out);
}
