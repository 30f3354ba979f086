/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The choices inside the training data: how many operators, drift or not, how smooth. */
#include "identify/families/bank_job.h"
#include <math.h>
#include <stdlib.h>

/* Times the best validation error: fewer operators win. */
static const double good_enough = 1.01;

/* Fitted on the first two thirds of the training data, judged on its last third. Sets the worst NRMSE. */
static bool validate(const bank_job_t *job, bank_candidate_t *candidate) {
    const size_t count = job->job->count;
    play_basis_t basis = bank_basis(job, candidate->operators);
    linear_options_t linear = job->linear;
    fit_span_t *inner = allocate(count, sizeof *inner);
    linear_fit_t fit;
    bool good;
    linear.drift = candidate->drift;
    for (size_t i = 0; i < count; i++) { /* train[i].from is where even the largest threshold is determined */
        const size_t useful = job->train[i].to - job->train[i].from;
        inner[i] = job->train[i];
        inner[i].to = inner[i].from + (size_t)(bank_training_part * (double)useful);
    }
    good = linear_fit(&basis, inner, count, &linear, &fit, job->failure);
    for (size_t i = 0; good && i < count; i++) {
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

/* The fewest operators within 1 % of the best, with and without drift apart. */
static size_t fewest_operators(const bank_job_t *job, double best) {
    size_t fewest = 0;
    for (size_t i = job->candidates; i-- > 0;) {
        const bank_candidate_t *candidate = &job->candidate[i];
        if (candidate->drift == job->linear.drift && candidate->validation_nrmse_percent <= good_enough * best) {
            fewest = candidate->operators;
        }
    }
    return fewest;
}

bool bank_choose_structure(bank_job_t *job) {
    static const size_t numbers[] = {1, 2, 3, 4, 6, 8, 10, 13, 16, 20, 25, 32, 40, 50, 64};
    const size_t given = job->job->operators;
    const size_t count = given > 0 ? 1 : sizeof numbers / sizeof numbers[0];
    const size_t drifts = job->creep ? 1 : 2; /* creep explains the drift, or nothing here does */
    double best_of_drift[2] = {HUGE_VAL, HUGE_VAL};
    play_basis_t widest = bank_basis(job, BANK_MAX_PLAIN_OPERATORS);
    bank_skip_undetermined(job, &widest);
    free(widest.threshold_v);
    for (size_t i = 0; i < drifts * count; i++) {
        const size_t wanted = given > 0 ? given : numbers[i / drifts];
        bank_candidate_t *candidate = &job->candidate[job->candidates++];
        /* Whether to take out drift is judged with few operators too: a dense bank would take minutes. */
        *candidate =
            (bank_candidate_t){.operators = wanted < BANK_MAX_PLAIN_OPERATORS ? wanted : BANK_MAX_PLAIN_OPERATORS,
                               .drift = i % drifts == 1};
        if (!validate(job, candidate)) {
            return false;
        }
        best_of_drift[i % drifts] = fmin(best_of_drift[i % drifts], candidate->validation_nrmse_percent);
        progress_update(job->job->progress, (double)(i + 1) / (double)(drifts * count));
    }
    job->linear.drift = best_of_drift[1] * good_enough < best_of_drift[0];
    job->operators = given > 0 ? given : fewest_operators(job, best_of_drift[job->linear.drift ? 1 : 0]);
    return true;
}

bool bank_choose_smoothing(bank_job_t *job, const play_basis_t *basis) {
    enum { DECADES = 8 };
    double floor_um = HUGE_VAL;
    for (int i = 0; i <= DECADES; i++) {
        linear_options_t linear = job->linear;
        linear_fit_t fit;
        linear.smoothing = pow(10.0, i - 5); /* 1e-5 to 1e3 */
        if (!linear_fit(basis, job->train, job->job->count, &linear, &fit, job->failure)) {
            return false;
        }
        floor_um = fmin(floor_um, fit.rms_um);
        if (fit.rms_um <= 1.002 * floor_um) {
            job->linear.smoothing = linear.smoothing;
        }
        linear_fit_free(&fit);
        progress_update(job->job->progress, (double)(i + 1) / (DECADES + 1));
    }
    return true;
}
