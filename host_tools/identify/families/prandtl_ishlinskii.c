/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Banks of play operators with fixed or with rate-dependent thresholds. docs/IDENTIFICATION.md, section 2.
 *
 * The number of operators, and whether to remove a drift of the offset, is chosen by validation inside the training
 * data: fitted to its first two thirds, validated on its last third. The smallest number within 1 % of the best is
 * chosen. With creep, gamma_per_decade is searched first; then the bank is fitted to the displacement without creep.
 *
 * Samples whose play memory still depends on the drive before the recording are excluded from the fit of the weights;
 * the initial memory is estimated from them afterwards. If they are most of the training data, the actuator is
 * initially assumed demagnetised at 0 V, and weights and initial memory are estimated alternately.
 */
#include "identify/creep_search.h"
#include "identify/families/bank_job.h"
#include "identify/fit_errors.h"
#include "identify/initial_memory.h"
#include "identify/rate_search.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

const double bank_training_part = 2.0 / 3.0;
/* Of the training data; below it the initial memory is estimated along with the weights. */
static const double least_determined_part = 0.25;
/*
 * w_0 is at least this part of the mean slope. Left alone it can go to 0 (a lag at one frequency looks like a small
 * threshold), and then the inverse jumps at every turning point. On the real recordings this bound costs less than 0.01
 * % NRMSE, 0.5 costs 0.04 %.
 */
static const double direct_part = 0.3;
/* Largest threshold of a rate-dependent fit, of half the range: leaves thresholds room to grow. */
static const double rate_threshold_part = 0.8;
/* An amplifier's drive range is the recorded one, widened by 5 % (compile.h). */
static const double widened = 1.05;

void bank_prepare(bank_job_t *job) {
    double slope = HUGE_VAL;
    for (size_t i = 0; i < job->job->count; i++) {
        const recording_t *recording = &job->recordings[i];
        const size_t end = job->job->train_to[i];
        double drive[2], displacement[2];
        job->train[i] = (fit_span_t){.recording = recording, .to = end};
        values_range(recording->column[COLUMN_DRIVE], end, drive);
        values_range(recording->column[COLUMN_DISPLACEMENT], end, displacement);
        job->half_range_v = fmax(job->half_range_v, 0.5 * (drive[1] - drive[0]));
        slope = fmin(slope, (displacement[1] - displacement[0]) / (drive[1] - drive[0]));
    }
    job->linear.least_direct = direct_part * slope;
}

play_basis_t bank_basis(const bank_job_t *job, size_t operators) {
    play_basis_t basis = {.operators = operators, .threshold_v = allocate(operators, sizeof(double))};
    const double step = job->room_to_grow ? rate_threshold_part / (double)operators : 1.0 / (double)(operators + 1);
    for (size_t i = 0; i < operators; i++) {
        basis.threshold_v[i] = job->half_range_v * step * (double)(i + 1);
    }
    basis.limit_v = widened * job->half_range_v - basis.threshold_v[operators - 1];
    return basis;
}

bool bank_skip_undetermined(bank_job_t *job, const play_basis_t *basis) {
    size_t used = 0, all = 0;
    for (size_t i = 0; i < job->job->count; i++) {
        job->train[i].from = play_memory_determined(basis, job->train[i].recording, job->train[i].to);
        used += job->train[i].to - job->train[i].from;
        all += job->train[i].to;
    }
    if ((double)used >= least_determined_part * (double)all) {
        return true;
    }
    for (size_t i = 0; i < job->job->count; i++) {
        job->train[i].from = 0;
    }
    return false;
}

/* Mean squared residual of the best bank, on displacements with creep removed. */
typedef struct {
    const bank_job_t *job;
    const play_basis_t *basis;
} creep_bank_t;

static bool fit_without_creep(void *context, const recording_t *elastic, double *mean_square, size_t *samples) {
    const creep_bank_t *bank = context;
    const size_t count = bank->job->job->count;
    fit_span_t *spans = allocate(count, sizeof *spans);
    linear_fit_t fit;
    bool good;
    for (size_t i = 0; i < count; i++) {
        spans[i] = bank->job->train[i];
        spans[i].recording = &elastic[i];
    }
    good = linear_fit(bank->basis, spans, count, &bank->job->linear, &fit, bank->job->failure);
    if (good) {
        *mean_square = fit.rms_um * fit.rms_um;
        *samples = fit.samples;
        linear_fit_free(&fit);
    }
    free(spans);
    return good;
}

/* Finds gamma with a bank of this many operators, and removes creep from the displacement. */
static bool find_creep(bank_job_t *job) {
    enum { OPERATORS = 32 };
    play_basis_t basis = bank_basis(job, OPERATORS);
    creep_bank_t bank = {.job = job, .basis = &basis};
    bank_skip_undetermined(job, &basis);
    const bool good = bank_find_creep(job, fit_without_creep, &bank);
    free(basis.threshold_v);
    return good;
}

bool bank_find_creep(bank_job_t *job, creep_fit_t *fit, void *context) {
    const bool good = creep_search(job->job->recordings, job->job->count, fit, context, &job->gamma_per_decade,
                                   &job->gamma_sigma, job->job->progress);
    job->creep = good && isfinite(job->gamma_sigma);
    if (job->creep) {
        job->elastic = creep_recordings(job->job->recordings, job->job->count, job->gamma_per_decade);
        job->recordings = job->elastic;
        for (size_t i = 0; i < job->job->count; i++) {
            job->train[i].recording = &job->recordings[i];
        }
    }
    return good;
}

static bool fit_bank(bank_job_t *job, play_basis_t *basis, linear_fit_t *fit) {
    return job->find_rate
               ? rate_search(basis, job->train, job->job->count, &job->linear, fit, job->job->progress, job->failure)
               : linear_fit(basis, job->train, job->job->count, &job->linear, fit, job->failure);
}

static void estimate_memories(bank_job_t *job, const play_basis_t *basis, const linear_fit_t *fit) {
    for (size_t i = 0; i < job->job->count; i++) {
        const recording_t *recording = &job->recordings[i];
        const size_t end = play_memory_determined(basis, recording, job->train[i].to);
        if (job->initial_v[i] == NULL) {
            job->initial_v[i] = allocate(basis->operators, sizeof(double));
        }
        estimate_initial_memory(basis, fit, recording, end, job->initial_v[i]);
        job->train[i].initial_v = job->initial_v[i];
    }
}

/* Weights and memories alternately, where the training data never become independent of the initial memory. Three
 * rounds: the second already changes little. */
static bool alternate(bank_job_t *job, play_basis_t *basis, linear_fit_t *fit) {
    for (int round = 0; round < 3; round++) {
        estimate_memories(job, basis, fit);
        linear_fit_free(fit);
        if (!fit_bank(job, basis, fit)) {
            return false;
        }
    }
    return true;
}

static bool fit_structure(bank_job_t *job, play_basis_t *basis, linear_fit_t *fit) {
    job->from_demagnetised = !bank_skip_undetermined(job, basis);
    if (job->operators > BANK_MAX_PLAIN_OPERATORS && !bank_choose_smoothing(job, basis)) {
        return false;
    }
    if (!fit_bank(job, basis, fit)) {
        return false;
    }
    basis->rate_dependent = basis->beta_s > 0.0;
    if (job->from_demagnetised && !alternate(job, basis, fit)) {
        return false;
    }
    estimate_memories(job, basis, fit);
    /* A smoothed density has no meaningful standard errors: the smoothing couples its parameters. */
    return job->linear.smoothing > 0.0 || linear_fit_sigma(basis, job->train, job->job->count, &job->linear, fit,
                                                           &job->autocorrelation_samples, job->failure);
}

/* Joint standard errors of all parameters, including beta and its filter. The drift, which is not in the model, must
 * not widen them. */
static bool find_joint_errors(const bank_job_t *job, const linear_fit_t *fit, model_t *model, family_notes_t *notes) {
    const size_t count = job->job->count;
    recording_t *steady = allocate(count, sizeof *steady);
    bool good;
    for (size_t i = 0; i < count; i++) {
        const recording_t *measured = &job->job->recordings[i];
        const size_t bytes = measured->samples * sizeof(double);
        recording_create(&steady[i], measured->name, measured->sample_rate_hz, measured->samples);
        memcpy(steady[i].column[COLUMN_DRIVE], measured->column[COLUMN_DRIVE], bytes);
        memcpy(steady[i].column[COLUMN_DISPLACEMENT], measured->column[COLUMN_DISPLACEMENT], bytes);
        for (size_t k = 0; k < measured->samples; k++) {
            steady[i].column[COLUMN_DISPLACEMENT][k] -= linear_fit_drift(fit, &job->train[i], k);
        }
    }
    good = fit_find_errors(model, steady, count, job->job->train_to, job->job->progress, notes, job->failure);
    for (size_t i = 0; i < count; i++) {
        recording_free(&steady[i]);
    }
    free(steady);
    return good;
}

static bool fit_prepared(bank_job_t *job, model_t *model, family_notes_t *notes) {
    play_basis_t basis;
    linear_fit_t fit = {0};
    bool good;
    bank_prepare(job);
    if ((job->job->creep && !find_creep(job)) || !bank_choose_structure(job)) {
        return false;
    }
    basis = bank_basis(job, job->operators);
    good = fit_structure(job, &basis, &fit);
    if (good) {
        bank_make_model(job, &basis, &fit, model, notes);
        good = !job->find_rate || find_joint_errors(job, &fit, model, notes);
        if (!good) {
            model_free(model);
        }
    }
    linear_fit_free(&fit);
    free(basis.threshold_v);
    return good;
}

static bool run(const family_job_t *family_job, bool room_to_grow, bool find_rate, model_t *model,
                family_notes_t *notes, failure_t *failure) {
    const size_t count = family_job->count;
    bank_job_t job = {.job = family_job,
                      .failure = failure,
                      .recordings = family_job->recordings,
                      .room_to_grow = room_to_grow,
                      .find_rate = find_rate,
                      .train = allocate(count, sizeof *job.train),
                      .initial_v = allocate(count, sizeof *job.initial_v)};
    const bool good = fit_prepared(&job, model, notes);
    for (size_t i = 0; i < count; i++) {
        free(job.initial_v[i]);
    }
    if (job.elastic != NULL) {
        creep_recordings_free(job.elastic, count);
    }
    free(job.initial_v);
    free(job.train);
    return good;
}

static bool fit_fixed(const family_job_t *job, model_t *model, family_notes_t *notes, failure_t *failure) {
    return run(job, false, false, model, notes, failure);
}

static bool fit_rate_dependent(const family_job_t *job, model_t *model, family_notes_t *notes, failure_t *failure) {
    return run(job, true, true, model, notes, failure);
}

/* The same thresholds as a rate-dependent bank. */
static bool fit_without_rate(const family_job_t *job, model_t *model, family_notes_t *notes, failure_t *failure) {
    return run(job, true, false, model, notes, failure);
}

static const family_t fixed_thresholds = {.name = "fixed thresholds",
                                          .text = "a rate-dependent bank with beta_s = 0",
                                          .fit = fit_without_rate,
                                          .finds_creep = true};

const family_t family_prandtl_ishlinskii = {.name = "prandtl_ishlinskii",
                                            .order = 10,
                                            .text = "play operators with fixed thresholds; any drive",
                                            .fit = fit_fixed,
                                            .finds_creep = true};

const family_t family_rate_dependent_prandtl_ishlinskii = {
    .name = "rate_dependent_prandtl_ishlinskii",
    .order = 20,
    .text = "thresholds that grow with the drive rate; several frequencies",
    .fit = fit_rate_dependent,
    .finds_creep = true,
    .without = &fixed_thresholds};
