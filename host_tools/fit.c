/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "fit.h"
#include "creep_search.h"
#include "fit_model.h"
#include "initial_memory.h"
#include "rate_search.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double training_part = 2.0 / 3.0;
/* Of the training data; below it the initial memory is estimated along with the weights. */
static const double least_determined_part = 0.25;
/*
 * w_0 is at least this part of the mean slope. Left alone it can go to 0 (a lag at one frequency looks like a small
 * threshold), and then the inverse jumps at every turning point. On the real recordings this bound costs less than 0.01
 * % NRMSE, 0.5 costs 0.04 %.
 */
static const double direct_part = 0.3;
/* Times the best validation error: fewer operators win. */
static const double good_enough = 1.01;
/* Largest threshold of a rate-dependent fit, of half the range: leaves thresholds room to grow. */
static const double rate_threshold_part = 0.8;
static const size_t least_samples = 30;

typedef struct {
    const recording_t *recordings; /* what the bank is fitted to: without creep, if creep is asked for */
    const recording_t *measured;
    size_t count;
    const fit_options_t *options;
    fit_report_t *report;
    failure_t *failure;
    progress_t progress;
    double half_range_v;
    linear_options_t linear;
    fit_span_t *train, *held_out;
    double **initial_v; /* a recording; NULL: demagnetised */
} job_t;

static bool check_recordings(const job_t *job) {
    for (size_t i = 0; i < job->count; i++) {
        const recording_t *recording = &job->recordings[i];
        if (recording->samples < least_samples) {
            return fail(job->failure, "%s: %zu samples are too few to fit, %zu are needed", recording->name,
                        recording->samples, least_samples);
        }
        if (recording->sample_rate_hz != job->recordings[0].sample_rate_hz) {
            return fail(job->failure, "%s: sampled at %g Hz, but %s at %g Hz: recordings fitted together need one rate",
                        recording->name, recording->sample_rate_hz, job->recordings[0].name,
                        job->recordings[0].sample_rate_hz);
        }
    }
    return true;
}

static void range_of(const double *values, size_t count, double range[2]) {
    range[0] = range[1] = values[0];
    for (size_t k = 1; k < count; k++) {
        range[0] = fmin(range[0], values[k]);
        range[1] = fmax(range[1], values[k]);
    }
}

/* Whether the displacement follows the drive downhill: a sign turned somewhere, which no play bank represents. */
static bool falls(const recording_t *recording, size_t samples) {
    double drive = 0.0, displacement = 0.0, covariance = 0.0;
    for (size_t k = 0; k < samples; k++) {
        drive += recording->column[COLUMN_DRIVE][k] / (double)samples;
        displacement += recording->column[COLUMN_DISPLACEMENT][k] / (double)samples;
    }
    for (size_t k = 0; k < samples; k++) {
        covariance +=
            (recording->column[COLUMN_DRIVE][k] - drive) * (recording->column[COLUMN_DISPLACEMENT][k] - displacement);
    }
    return covariance < 0.0;
}

/* Cuts the recordings, and measures the range of the training data. */
static bool prepare(job_t *job) {
    double slope = HUGE_VAL;
    for (size_t i = 0; i < job->count; i++) {
        const recording_t *recording = &job->recordings[i];
        const size_t cut = (size_t)(training_part * (double)recording->samples);
        double drive[2], displacement[2];
        job->train[i] = (fit_span_t){.recording = recording, .to = cut};
        job->held_out[i] = (fit_span_t){.recording = recording, .from = cut, .to = recording->samples};
        range_of(recording->column[COLUMN_DRIVE], cut, drive);
        range_of(recording->column[COLUMN_DISPLACEMENT], cut, displacement);
        if (!(drive[1] > drive[0]) || !(displacement[1] > displacement[0])) {
            return fail(job->failure, "%s: the %s does not change in the first two thirds: nothing to fit",
                        recording->name, drive[1] > drive[0] ? "displacement" : "drive");
        }
        if (falls(recording, cut)) {
            return fail(job->failure,
                        "%s: the displacement falls where the drive rises: turn the sign of one of them before the fit",
                        recording->name);
        }
        job->half_range_v = fmax(job->half_range_v, 0.5 * (drive[1] - drive[0]));
        slope = fmin(slope, (displacement[1] - displacement[0]) / (drive[1] - drive[0]));
        job->report->recording[i].held_out_s = recording->start_s + (double)cut / recording->sample_rate_hz;
    }
    job->linear.least_direct = direct_part * slope;
    return true;
}

static play_basis_t make_basis(const job_t *job, size_t operators) {
    play_basis_t basis = {.operators = operators, .threshold_v = allocate(operators, sizeof(double))};
    const double step =
        job->options->rate_dependent ? rate_threshold_part / (double)operators : 1.0 / (double)(operators + 1);
    for (size_t i = 0; i < operators; i++) {
        basis.threshold_v[i] = job->half_range_v * step * (double)(i + 1);
    }
    basis.limit_v = model_growth_limit(job->half_range_v, operators > 0 ? basis.threshold_v[operators - 1] : 0.0);
    return basis;
}

/*
 * Sets `from` of the spans to where the memory is determined. Returns false, with from = 0, when that leaves less than
 * a quarter of all samples.
 */
static bool skip_undetermined(const play_basis_t *basis, fit_span_t *spans, size_t count) {
    size_t used = 0, all = 0;
    for (size_t i = 0; i < count; i++) {
        spans[i].from = play_memory_determined(basis, spans[i].recording, spans[i].to);
        used += spans[i].to - spans[i].from;
        all += spans[i].to;
    }
    if ((double)used >= least_determined_part * (double)all) {
        return true;
    }
    for (size_t i = 0; i < count; i++) {
        spans[i].from = 0;
    }
    return false;
}

/* Fitted on the first two thirds of the training data, judged on its last third. Returns the worst NRMSE. */
static bool validate(job_t *job, fit_candidate_t *candidate) {
    play_basis_t basis = make_basis(job, candidate->operators);
    linear_options_t linear = job->linear;
    fit_span_t *inner = allocate(job->count, sizeof *inner);
    linear_fit_t fit;
    bool good;
    linear.drift = candidate->drift;
    for (size_t i = 0; i < job->count; i++) { /* train[i].from is where even the largest threshold is determined */
        const size_t useful = job->train[i].to - job->train[i].from;
        inner[i] = job->train[i];
        inner[i].to = inner[i].from + (size_t)(training_part * (double)useful);
    }
    good = linear_fit(&basis, inner, job->count, &linear, &fit, job->failure);
    for (size_t i = 0; good && i < job->count; i++) {
        const fit_span_t judged = {.recording = inner[i].recording, .from = inner[i].to, .to = job->train[i].to};
        const error_measure_t error = linear_fit_error(&basis, &fit, &judged);
        if (isfinite(error.nrmse_percent)) { /* a part without motion judges nothing */
            candidate->validation_nrmse_percent = fmax(candidate->validation_nrmse_percent, error.nrmse_percent);
        }
    }
    if (good) {
        linear_fit_free(&fit);
    }
    free(basis.threshold_v);
    free(inner);
    return good;
}

/* Chooses the number of operators, and whether the drift of the offset is taken out. All candidates see the same
 * samples. */
static bool choose_structure(job_t *job) {
    static const size_t numbers[] = {1, 2, 3, 4, 6, 8, 10, 13, 16, 20, 25, 32, 40, 50, 64};
    fit_report_t *report = job->report;
    const bool given = job->options->operators > 0;
    const size_t count = given ? 1 : sizeof numbers / sizeof numbers[0];
    const size_t drifts = report->creep ? 1 : 2; /* creep explains the drift, or nothing here does */
    double best = HUGE_VAL, best_of_drift[2] = {HUGE_VAL, HUGE_VAL};
    play_basis_t widest = make_basis(job, FIT_MAX_PLAIN_OPERATORS);
    skip_undetermined(&widest, job->train, job->count);
    free(widest.threshold_v);
    for (size_t i = 0; i < drifts * count; i++) {
        const size_t wanted = given ? job->options->operators : numbers[i / drifts];
        fit_candidate_t *candidate = &report->candidate[report->candidates++];
        /* Whether to take out drift is judged with few operators too: a dense bank would take minutes. */
        *candidate = (fit_candidate_t){.operators = wanted < FIT_MAX_PLAIN_OPERATORS ? wanted : FIT_MAX_PLAIN_OPERATORS,
                                       .drift = i % drifts == 1};
        if (!validate(job, candidate)) {
            return false;
        }
        best_of_drift[i % drifts] = fmin(best_of_drift[i % drifts], candidate->validation_nrmse_percent);
        progress_update(&job->progress, (double)(i + 1) / (double)(drifts * count));
    }
    report->drift = best_of_drift[1] * good_enough < best_of_drift[0];
    best = best_of_drift[report->drift ? 1 : 0];
    for (size_t i = report->candidates; i-- > 0;) {
        const fit_candidate_t *candidate = &report->candidate[i];
        if (candidate->drift == report->drift && candidate->validation_nrmse_percent <= good_enough * best) {
            report->operators = candidate->operators;
        }
    }
    if (given) {
        report->operators = job->options->operators;
    }
    job->linear.drift = report->drift;
    return true;
}

/* The smoothest dense bank that explains the training data within 0.2 % of what an unsmoothed one does. */
static bool choose_smoothing(job_t *job, const play_basis_t *basis) {
    enum { DECADES = 8 };
    double floor_um = HUGE_VAL;
    for (int i = 0; i <= DECADES; i++) {
        linear_options_t linear = job->linear;
        linear_fit_t fit;
        linear.smoothing = pow(10.0, i - 5); /* 1e-5 to 1e3 */
        if (!linear_fit(basis, job->train, job->count, &linear, &fit, job->failure)) {
            return false;
        }
        floor_um = fmin(floor_um, fit.rms_um);
        if (fit.rms_um <= 1.002 * floor_um) {
            job->linear.smoothing = linear.smoothing;
        }
        linear_fit_free(&fit);
        progress_update(&job->progress, (double)(i + 1) / (DECADES + 1));
    }
    job->report->smoothing = job->linear.smoothing;
    return true;
}

static bool fit_bank(job_t *job, play_basis_t *basis, linear_fit_t *fit, double *beta_sigma_s) {
    return job->options->rate_dependent ? rate_search(basis, job->train, job->count, &job->linear, fit, beta_sigma_s,
                                                      &job->progress, job->failure)
                                        : linear_fit(basis, job->train, job->count, &job->linear, fit, job->failure);
}

static void estimate_memories(job_t *job, const play_basis_t *basis, const linear_fit_t *fit) {
    for (size_t i = 0; i < job->count; i++) {
        const recording_t *recording = &job->recordings[i];
        const size_t end = play_memory_determined(basis, recording, job->train[i].to);
        if (job->initial_v[i] == NULL) {
            job->initial_v[i] = allocate(basis->operators, sizeof(double));
        }
        job->report->recording[i].initial_mean_error_um =
            estimate_initial_memory(basis, fit, recording, end, job->initial_v[i]);
        job->report->recording[i].determined_s = recording->start_s + (double)end / recording->sample_rate_hz;
        job->train[i].initial_v = job->initial_v[i];
        job->held_out[i].initial_v = job->initial_v[i];
    }
}

/* Weights and memories in turn, where the training data never forget the memory. Three rounds: the second already
 * changes little. */
static bool alternate(job_t *job, play_basis_t *basis, linear_fit_t *fit, double *beta_sigma_s) {
    for (int round = 0; round < 3; round++) {
        estimate_memories(job, basis, fit);
        linear_fit_free(fit);
        if (!fit_bank(job, basis, fit, beta_sigma_s)) {
            return false;
        }
    }
    return true;
}

/* Of the whole chain over the span of recording i. */
static error_measure_t span_error(const job_t *job, const play_basis_t *basis, const linear_fit_t *fit, size_t i,
                                  const fit_span_t *span) {
    const recording_t *measured = &job->measured[i];
    double *position = allocate(span->to, sizeof(double));
    error_measure_t error;
    linear_fit_predict(basis, fit, span, position);
    if (job->report->creep) {
        const creep_cells_t cells = creep_default_cells(job->report->gamma_per_decade, measured->sample_rate_hz);
        creep_apply(&cells, position, span->to, creep_initial(&cells, measured), position);
    }
    error =
        measure_error(measured->column[COLUMN_DISPLACEMENT] + span->from, position + span->from, span->to - span->from);
    free(position);
    return error;
}

static void measure(job_t *job, const play_basis_t *basis, const linear_fit_t *fit) {
    fit_report_t *report = job->report;
    for (size_t i = 0; i < job->count; i++) {
        const error_measure_t train = span_error(job, basis, fit, i, &job->train[i]);
        const error_measure_t held_out = span_error(job, basis, fit, i, &job->held_out[i]);
        report->recording[i].train_nrmse_percent = train.nrmse_percent;
        report->recording[i].held_out_nrmse_percent = held_out.nrmse_percent;
        report->recording[i].held_out_max_um = held_out.max_um;
        report->nrmse_percent = fmax(report->nrmse_percent, train.nrmse_percent);
        report->held_out_nrmse_percent = fmax(report->held_out_nrmse_percent, held_out.nrmse_percent);
    }
}

/* What rate dependence is worth: the same bank with fixed thresholds. */
static bool measure_static(job_t *job, const play_basis_t *basis) {
    play_basis_t fixed = *basis;
    linear_fit_t fit;
    fixed.rate_dependent = false;
    if (!linear_fit(&fixed, job->train, job->count, &job->linear, &fit, job->failure)) {
        return false;
    }
    for (size_t i = 0; i < job->count; i++) {
        const error_measure_t error = span_error(job, &fixed, &fit, i, &job->held_out[i]);
        job->report->static_held_out_nrmse_percent =
            fmax(job->report->static_held_out_nrmse_percent, error.nrmse_percent);
    }
    linear_fit_free(&fit);
    return true;
}

static bool fit_structure(job_t *job, play_basis_t *basis, linear_fit_t *fit, double *beta_sigma_s) {
    fit_report_t *report = job->report;
    report->from_demagnetised = !skip_undetermined(basis, job->train, job->count);
    if (report->operators > FIT_MAX_PLAIN_OPERATORS && !choose_smoothing(job, basis)) {
        return false;
    }
    if (!fit_bank(job, basis, fit, beta_sigma_s)) {
        return false;
    }
    basis->rate_dependent = basis->beta_s > 0.0;
    if (report->from_demagnetised && !alternate(job, basis, fit, beta_sigma_s)) {
        return false;
    }
    estimate_memories(job, basis, fit);
    measure(job, basis, fit);
    if (job->options->rate_dependent && !measure_static(job, basis)) {
        return false;
    }
    if (job->options->use_all) {
        for (size_t i = 0; i < job->count; i++) {
            job->train[i].to = job->recordings[i].samples;
        }
        linear_fit_free(fit);
        if (!linear_fit(basis, job->train, job->count, &job->linear, fit, job->failure)) {
            return false;
        }
    }
    report->drift_um = fit->drift_um;
    report->rms_um = fit->rms_um;
    /* A smoothed density has no standard errors worth the name: its numbers are tied to each other by the smoothing. */
    return job->linear.smoothing > 0.0 || linear_fit_sigma(basis, job->train, job->count, &job->linear, fit,
                                                           &report->autocorrelation_samples, job->failure);
}

/* Finds gamma on the training data with a bank of this many operators, and goes on with the displacement without creep.
 */
static bool find_creep(job_t *job, recording_t **elastic) {
    enum { OPERATORS = 32 };
    fit_report_t *report = job->report;
    play_basis_t basis = make_basis(job, OPERATORS);
    bool good;
    skip_undetermined(&basis, job->train, job->count);
    good = creep_search(&basis, job->train, job->count, &job->linear, &report->gamma_per_decade, &report->gamma_sigma,
                        &job->progress, job->failure);
    free(basis.threshold_v);
    report->creep = good && isfinite(report->gamma_sigma);
    if (report->creep) {
        *elastic = creep_recordings(job->measured, job->count, report->gamma_per_decade);
        job->recordings = *elastic;
        for (size_t i = 0; i < job->count; i++) {
            job->train[i].recording = &job->recordings[i];
            job->held_out[i].recording = &job->recordings[i];
        }
    }
    return good;
}

static bool fit_all(job_t *job, model_t *model, recording_t **elastic) {
    play_basis_t basis;
    linear_fit_t fit = {0};
    double beta_sigma_s = HUGE_VAL;
    bool good;
    if (!check_recordings(job) || !prepare(job) || (job->options->creep && !find_creep(job, elastic)) ||
        !choose_structure(job)) {
        return false;
    }
    basis = make_basis(job, job->report->operators);
    good = fit_structure(job, &basis, &fit, &beta_sigma_s);
    if (good) {
        make_fitted_model(job->measured, job->count, &basis, &fit, beta_sigma_s,
                          job->count == 1 ? job->initial_v[0] : NULL, job->options, job->report, model);
        good = model_check(model, "fitted model", job->failure);
        if (!good) {
            model_free(model);
        }
    }
    linear_fit_free(&fit);
    free(basis.threshold_v);
    return good;
}

bool fit_recordings(const recording_t *recordings, size_t count, const fit_options_t *options, model_t *model,
                    fit_report_t *report, failure_t *failure) {
    job_t job = {.recordings = recordings,
                 .measured = recordings,
                 .count = count,
                 .options = options,
                 .report = report,
                 .failure = failure};
    recording_t *elastic = NULL;
    bool good;
    *report = (fit_report_t){.recordings = count, .recording = allocate(count, sizeof *report->recording)};
    job.train = allocate(count, sizeof *job.train);
    job.held_out = allocate(count, sizeof *job.held_out);
    job.initial_v = allocate(count, sizeof *job.initial_v);
    progress_begin(&job.progress, "fitting");
    good = fit_all(&job, model, &elastic);
    progress_end(&job.progress);
    for (size_t i = 0; i < count; i++) {
        free(job.initial_v[i]);
    }
    if (elastic != NULL) {
        creep_recordings_free(elastic, count);
    }
    free(job.initial_v);
    free(job.train);
    free(job.held_out);
    if (!good) {
        fit_report_free(report);
    }
    return good;
}

void fit_report_free(fit_report_t *report) {
    free(report->recording);
    memset(report, 0, sizeof *report);
}
