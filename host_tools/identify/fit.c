/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "identify/fit.h"
#include "base/json_output.h"
#include "chain/chain.h"
#include "chain/fit_ranges.h"
#include "identify/fit_errors.h"
#include "numerics/reversals.h"
#include <gsl/gsl_statistics_double.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double training_part = 2.0 / 3.0;
static const size_t least_samples = 30;

typedef struct {
    const family_t *family;
    const recording_t *recordings;
    size_t count;
    const fit_options_t *options;
    fit_report_t *report;
    failure_t *failure;
    progress_t progress;
    size_t *train_to;
} job_t;

static bool changes(const double *values, size_t count) {
    size_t k = 1;
    while (k < count && values[k] == values[0]) {
        k++;
    }
    return k < count;
}

/* Whether the displacement falls where the drive rises: a wrong sign somewhere, which no hysteresis can represent. */
static bool falls(const recording_t *recording, size_t samples) {
    const double *drive = recording->column[COLUMN_DRIVE], *displacement = recording->column[COLUMN_DISPLACEMENT];
    return gsl_stats_covariance(drive, 1, displacement, 1, samples) < 0.0;
}

/* How often the drive goes through its range in a second, there or back. */
static double passes_per_s(const recording_t *recording, size_t samples) {
    const double *drive = recording->column[COLUMN_DRIVE];
    double way = 0.0, range[2];
    values_range(drive, samples, range);
    for (size_t k = 1; k < samples; k++) {
        way += fabs(drive[k] - drive[k - 1]);
    }
    return way / (range[1] - range[0]) * recording->sample_rate_hz / (double)samples;
}

/* Of the slowest: faster ones may be beyond the mechanics' first mode, where the position goes against the drive. */
static bool check_sign(const job_t *job) {
    double slowest = HUGE_VAL;
    size_t slow = 0;
    for (size_t i = 0; i < job->count; i++) {
        const double passes = passes_per_s(&job->recordings[i], job->train_to[i]);
        if (passes < slowest) {
            slowest = passes;
            slow = i;
        }
    }
    return !falls(&job->recordings[slow], job->train_to[slow]) ||
           fail(job->failure,
                "%s: the displacement falls where the drive rises: turn the sign of one of them before the fit, or "
                "record a slower drive, too",
                job->recordings[slow].name);
}

/* By more than half of its range, in any of the recordings. */
static bool turns_round(const job_t *job) {
    bool turns = false;
    for (size_t i = 0; i < job->count; i++) {
        const recording_t *recording = &job->recordings[i];
        turns = turns || reversals_count_by_part(recording->column[COLUMN_DRIVE], recording->samples, 0.5) > 0;
    }
    return turns;
}

/* Checks the recordings and splits them into training and held-out parts. */
static bool prepare(job_t *job) {
    for (size_t i = 0; i < job->count; i++) {
        const recording_t *recording = &job->recordings[i];
        const size_t cut = (size_t)(training_part * (double)recording->samples);
        if (recording->samples < least_samples) {
            return fail(job->failure, "%s: %zu samples are too few to fit, %zu are needed", recording->name,
                        recording->samples, least_samples);
        }
        for (column_t column = COLUMN_DRIVE; column <= COLUMN_DISPLACEMENT; column++) {
            if (!changes(recording->column[column], cut)) {
                return fail(job->failure, "%s: the %s does not change in the first two thirds: nothing to fit",
                            recording->name, column_name(column));
            }
        }
        job->train_to[i] = cut;
        job->report->recording[i].held_out_s = recording->start_s + (double)cut / recording->sample_rate_hz;
    }
    return check_sign(job);
}

/* Fits a family to the samples before train_to. */
static bool run_family(job_t *job, const family_t *family, size_t operators, const size_t *train_to, model_t *model,
                       family_notes_t *notes) {
    const family_job_t family_job = {.recordings = job->recordings,
                                     .count = job->count,
                                     .train_to = train_to,
                                     .operators = operators,
                                     .creep = job->options->creep,
                                     .progress = &job->progress};
    if (!family->fit(&family_job, model, notes, job->failure)) {
        return false;
    }
    if (!model_check(model, "fitted model", job->failure)) {
        model_free(model);
        return false;
    }
    return true;
}

/* The number of operators of a model, if its family set it; else that of the options. */
static size_t operators_of(const job_t *job, const model_t *model) {
    const json_t *operators = json_object_get(model->fit, "operators");
    return json_is_integer(operators) ? (size_t)json_integer_value(operators) : job->options->operators;
}

/* The simulated recordings, to be freed with free_simulated; NULL on failure. */
static double **simulate(const job_t *job, const model_t *model) {
    double **simulated = allocate(job->count, sizeof *simulated);
    bool good = true;
    for (size_t i = 0; good && i < job->count; i++) {
        const recording_t *recording = &job->recordings[i];
        simulated[i] = allocate(recording->samples, sizeof(double));
        good = chain_simulate(model, recording, 0, simulated[i], job->failure);
        for (size_t k = 0; good && k < recording->samples; k++) {
            good = isfinite(simulated[i][k]) || fail(job->failure,
                                                     "%s: the fitted model is unstable: it runs away at "
                                                     "sample %zu",
                                                     recording->name, k);
        }
    }
    if (good) {
        return simulated;
    }
    for (size_t i = 0; i < job->count; i++) {
        free(simulated[i]);
    }
    free(simulated);
    return NULL;
}

static void free_simulated(const job_t *job, double **simulated) {
    for (size_t i = 0; i < job->count; i++) {
        free(simulated[i]);
    }
    free(simulated);
}

static error_measure_t error_between(const recording_t *recording, const double *simulated, size_t from, size_t to) {
    return measure_error(recording->column[COLUMN_DISPLACEMENT] + from, simulated + from, to - from);
}

/* NAN as long as nothing was judged: a part without motion, whose NRMSE is not finite, judges nothing. */
static double worse(double so_far, double nrmse_percent) {
    return isfinite(nrmse_percent) ? fmax(so_far, nrmse_percent) : so_far;
}

/* The worst held-out NRMSE of a model. */
static bool judge_held_out(const job_t *job, const model_t *model, double *worst_percent) {
    double **simulated = simulate(job, model);
    if (simulated == NULL) {
        return false;
    }
    *worst_percent = (double)NAN;
    for (size_t i = 0; i < job->count; i++) {
        const error_measure_t error =
            error_between(&job->recordings[i], simulated[i], job->train_to[i], job->recordings[i].samples);
        *worst_percent = worse(*worst_percent, error.nrmse_percent);
    }
    free_simulated(job, simulated);
    return true;
}

static double mean_error(const recording_t *recording, const double *simulated, size_t end) {
    double sum = 0.0;
    for (size_t k = 0; k < end; k++) {
        sum += fabs(recording->column[COLUMN_DISPLACEMENT][k] - simulated[k]);
    }
    return end > 0 ? sum / (double)end : 0.0;
}

static bool judge(job_t *job, const model_t *model) {
    fit_report_t *report = job->report;
    double **simulated = simulate(job, model);
    size_t *determined;
    bool never;
    if (simulated == NULL) {
        return false;
    }
    determined = allocate(job->count, sizeof *determined);
    never = !chain_determined_from(model, job->recordings, job->count, job->train_to, determined);
    report->nrmse_percent = report->held_out_nrmse_percent = (double)NAN;
    for (size_t i = 0; i < job->count; i++) {
        const recording_t *recording = &job->recordings[i];
        const size_t cut = job->train_to[i], from = never || determined[i] == cut ? 0 : determined[i];
        const error_measure_t train = error_between(recording, simulated[i], from, cut);
        const error_measure_t held_out = error_between(recording, simulated[i], cut, recording->samples);
        fit_recording_report_t *r = &report->recording[i];
        const double period_s = 1.0 / recording->sample_rate_hz;
        r->train_nrmse_percent = train.nrmse_percent;
        r->held_out_nrmse_percent = held_out.nrmse_percent;
        r->held_out_max_um = held_out.max_um;
        r->held_out_max_s = recording->start_s + (double)(cut + held_out.max_sample) * period_s;
        r->train_s = recording->start_s + (double)from * period_s;
        r->determined_s = recording->start_s + (double)determined[i] * period_s;
        r->initial_mean_error_um = mean_error(recording, simulated[i], determined[i]);
        report->nrmse_percent = worse(report->nrmse_percent, train.nrmse_percent);
        report->held_out_nrmse_percent = worse(report->held_out_nrmse_percent, held_out.nrmse_percent);
        report->held_out_max_um = fmax(report->held_out_max_um, held_out.max_um);
    }
    free(determined);
    free_simulated(job, simulated);
    return true;
}

static json_t *recordings_to_json(const job_t *job) {
    json_t *list = json_array();
    for (size_t i = 0; i < job->count; i++) {
        const fit_recording_report_t *r = &job->report->recording[i];
        json_array_append_new(list,
                              json_pack("{s:s, s:I, s:o, s:o, s:f, s:f, s:f, s:f, s:f}", "name",
                                        job->recordings[i].name, "samples", (json_int_t)job->recordings[i].samples,
                                        "nrmse_percent", json_number_or_null(r->train_nrmse_percent),
                                        "held_out_nrmse_percent", json_number_or_null(r->held_out_nrmse_percent),
                                        "held_out_max_um", r->held_out_max_um, "held_out_max_s", r->held_out_max_s,
                                        "held_out_from_s", r->held_out_s, "memory_determined_from_s", r->determined_s,
                                        "initial_memory_mean_error_um", r->initial_mean_error_um));
    }
    return list;
}

static json_t *notes_to_json(const family_notes_t *notes) {
    json_t *list = json_array();
    for (size_t i = 0; i < notes->count; i++) {
        json_array_append_new(list, json_string(notes->line[i]));
    }
    return list;
}

/* Adds the facts common to all families to those of the family. */
static void describe(const job_t *job, model_t *model) {
    const fit_report_t *report = job->report;
    json_t *fit = json_pack("{s:s, s:o, s:o, s:f, s:b, s:b, s:o}", "family", job->family->name, "nrmse_percent",
                            json_number_or_null(report->nrmse_percent), "held_out_nrmse_percent",
                            json_number_or_null(report->held_out_nrmse_percent), "held_out_max_um",
                            report->held_out_max_um, "operators_given", (int)(job->options->operators > 0),
                            "fitted_to_all", (int)job->options->use_all, "recordings", recordings_to_json(job));
    fit_ranges_set(fit, job->recordings, job->count, NULL);
    json_object_set_new(fit, "notes", notes_to_json(&report->notes));
    if (job->family->without != NULL) {
        json_object_set_new(fit, "without",
                            json_pack("{s:s, s:o}", "name", job->family->without->name, "held_out_nrmse_percent",
                                      json_number_or_null(report->without_held_out_nrmse_percent)));
    }
    json_object_update(fit, model->fit);
    json_decref(model->fit);
    model->fit = fit;
}

static bool judge_without(job_t *job, size_t operators) {
    family_notes_t notes = {0};
    model_t model;
    bool good;
    job->report->without_held_out_nrmse_percent = (double)NAN;
    if (job->family->without == NULL) {
        return true;
    }
    if (!run_family(job, job->family->without, operators, job->train_to, &model, &notes)) {
        return false;
    }
    good = judge_held_out(job, &model, &job->report->without_held_out_nrmse_percent);
    model_free(&model);
    return good;
}

/* Replaces *model by one fitted to the whole recordings; the facts stay those of the fit with a held-out part. */
static bool fit_to_all(job_t *job, size_t operators, model_t *model) {
    size_t *whole = allocate(job->count, sizeof *whole);
    family_notes_t notes = {0};
    model_t final;
    bool good;
    for (size_t i = 0; i < job->count; i++) {
        whole[i] = job->recordings[i].samples;
    }
    good = run_family(job, job->family, operators, whole, &final, &notes);
    if (good && !fit_find_errors(&final, job->recordings, job->count, whole, &job->progress, &notes, job->failure)) {
        model_free(&final);
        good = false;
    }
    if (good) {
        json_decref(final.fit);
        final.fit = json_incref(model->fit);
        model_free(model);
        *model = final;
    }
    free(whole);
    return good;
}

static bool run(job_t *job, model_t *model) {
    size_t operators;
    if (!prepare(job) ||
        !run_family(job, job->family, job->options->operators, job->train_to, model, &job->report->notes)) {
        return false;
    }
    if (job->options->creep && !job->family->finds_creep && model_find(model, "creep") == NULL) {
        family_note(&job->report->notes, "creep: family %s does not look for it", job->family->name);
    }
    if (!turns_round(job)) {
        family_note(&job->report->notes,
                    "the drive never turns round by more than half of its range: the loops of this "
                    "model are not determined");
    }
    operators = operators_of(job, model);
    if (!judge(job, model) || !judge_without(job, operators) ||
        !(job->options->use_all ? fit_to_all(job, operators, model)
                                : fit_find_errors(model, job->recordings, job->count, job->train_to, &job->progress,
                                                  &job->report->notes, job->failure))) {
        model_free(model);
        return false;
    }
    job->report->parameters = fit_count_found(model);
    describe(job, model);
    return true;
}

bool fit_recordings(const family_t *family, const recording_t *recordings, size_t count, const fit_options_t *options,
                    model_t *model, fit_report_t *report, failure_t *failure) {
    job_t job = {.family = family,
                 .recordings = recordings,
                 .count = count,
                 .options = options,
                 .report = report,
                 .failure = failure,
                 .train_to = allocate(count, sizeof *job.train_to)};
    bool good;
    *report =
        (fit_report_t){.family = family, .recordings = count, .recording = allocate(count, sizeof *report->recording)};
    progress_begin(&job.progress, "fitting");
    good = run(&job, model);
    if (!progress_go_on(failure)) {
        if (good) {
            model_free(model);
        }
        good = false;
    }
    progress_end(&job.progress);
    free(job.train_to);
    if (!good) {
        fit_report_free(report);
    }
    return good;
}

void fit_report_free(fit_report_t *report) {
    free(report->recording);
    memset(report, 0, sizeof *report);
}
