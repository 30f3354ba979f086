/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/evidence/joint_fit.h"
#include "base/parallel.h"
#include "chain/smooth_drive.h"
#include "diagnosis/evidence/searched.h"
#include "diagnosis/nuisance/past.h"
#include "diagnosis/nuisance/signals.h"
#include "numerics/autocorrelation.h"
#include "numerics/gauss_newton.h"
#include "numerics/least_squares.h"
#include <gsl/gsl_cblas.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* What the samples say nothing about stays where it was: of a table, whose neighbours determine each other, changes
 * weigh this part of what the samples give the mean element. */
static const double stay_part_many = 1e-3;
static const size_t many = 65;
/* A hysteresis of fewer numbers is not linear in them: it takes more iterations, and they cost little. A table takes
 * fewer. */
static const size_t few_iterations = 6;
/* Derivatives by the numbers of a hysteresis that is linear in them change only with what other blocks make of it: they
 * serve for so many iterations. */
static const size_t most_uses = 3;
/* Of the sum of squares, times the number of samples: the search ends when it falls by less. */
static const double settled_likelihood = 0.3;
/* Of what the samples give a searched number, added to it: for a step that does not diverge, and for an error that
 * grows where two numbers take each other's place. */
static const double step_part = 1e-6, error_part = 1e-12;
/* One step, a third of it, a ninth .. */
static const gauss_newton_tunables_t tunables = {.most_trials = 6, .worth = 1.0, .shorten = 0.3};

typedef struct {
    const samples_t *samples;
    const noise_t *noise;
    model_t *model;
    size_t set_aside; /* of its blocks, the last ones */
    size_t blocks, block[MODEL_MAX_BLOCKS];
    searched_t searched[MODEL_MAX_BLOCKS];
    hysteresis_numbers_t hysteresis;
    double *moved; /* of the hysteresis' numbers, since the beginning */
    size_t unknowns;
    double *white, *column;      /* scratch columns */
    double *matrix;              /* unknowns columns of whitened derivatives, fitted samples each */
    bool linear;                 /* the hysteresis' numbers are many, and it is linear in them */
    bool fresh;                  /* the hysteresis' columns are those of the model as it is */
    size_t uses;                 /* that they have served for */
    double *gram;                /* of the matrix */
    double *residual, *held;     /* whitened, the samples of either part, */
    past_t past;                 /* less what this explains of them */
    joint_power_t *power, tried; /* where the model stands, and where it was moved to */
} job_t;

static void take_residual(job_t *job, const double *simulated, joint_power_t *power) {
    samples_residual(job->samples, simulated, job->column);
    noise_whiten(job->noise, job->samples, job->column, job->white);
    const int fitted = (int)samples_pick(job->samples, SAMPLE_FITTED, job->white, job->residual);
    const int held = (int)samples_pick(job->samples, SAMPLE_HELD_OUT, job->white, job->held);
    past_take_out(&job->past, job->residual, job->held);
    power->fitted = cblas_ddot(fitted, job->residual, 1, job->residual, 1);
    power->held = cblas_ddot(held, job->held, 1, job->held, 1);
}

static bool take_power(job_t *job, joint_power_t *power, failure_t *failure) {
    double *simulated = samples_column(job->samples);
    const bool good = samples_simulate(job->samples, job->model, simulated, failure);
    if (good) {
        take_residual(job, simulated, power);
    }
    free(simulated);
    return good && isfinite(power->fitted);
}

/* Derivative by a searched parameter. */
static bool derive_searched(const job_t *job, const signals_t *signals, size_t block, size_t i, double *column) {
    const size_t at = job->block[block];
    model_t nudged;
    const double difference = searched_nudge(&job->searched[block], i, job->model, at, &nudged);
    const bool simulated = signals_altered(signals, &nudged, stage_of(&nudged, at), column);
    model_free(&nudged);
    cblas_daxpy((int)job->samples->all, -1.0, signals->simulated, 1, column, 1);
    cblas_dscal((int)job->samples->all, 1.0 / difference, column, 1);
    return simulated;
}

static bool derive(const job_t *job, const signals_t *signals, size_t unknown, double *column) {
    size_t block = 0;
    if (unknown < job->hysteresis.count) {
        return signals_derivative(signals, &job->hysteresis, unknown, column);
    }
    unknown -= job->hysteresis.count;
    while (unknown >= job->searched[block].count) {
        unknown -= job->searched[block++].count;
    }
    return derive_searched(job, signals, block, unknown, column);
}

typedef struct {
    const job_t *job;
    const signals_t *signals;
    size_t first; /* of the unknowns, the first whose column is wanted */
} derivation_t;

/* A column of the matrix: 0 where there is no model beside this one. */
static void take_column(void *context, size_t index) {
    const derivation_t *derivation = context;
    const job_t *job = derivation->job;
    const size_t unknown = derivation->first + index;
    double *rows = job->matrix + unknown * job->samples->fitted, *column = samples_column(job->samples);
    if (derive(job, derivation->signals, unknown, column)) {
        noise_whiten_fitted(job->noise, job->samples, column, rows);
        past_take_out(&job->past, rows, NULL);
    } else {
        memset(rows, 0, job->samples->fitted * sizeof(double));
    }
    free(column);
}

static void take_matrix(job_t *job, signals_t *signals) {
    if (job->fresh) {
        signals_differentiate(signals, &job->hysteresis);
    }
    derivation_t derivation = {.job = job, .signals = signals, .first = job->fresh ? 0 : job->hysteresis.count};
    parallel(job->unknowns - derivation.first, take_column, &derivation);
    signals_forget(signals);
}

/* What the samples say nothing about stays, of a table where it is, of a bank where it was in the beginning. */
static void stay_near(const job_t *job, double variance, double searched_part, normal_equations_t *equations) {
    const size_t n = job->unknowns, plays = job->hysteresis.count;
    double *row = allocate(n, sizeof(double)), mean = 0.0;
    for (size_t j = 0; j < plays; j++) {
        mean += equations->gram[j * n + j] / (double)plays;
    }
    for (size_t j = 0; j < n; j++) {
        const double own = equations->gram[j * n + j];
        double weight = searched_part * own + (own > 0.0 ? 0.0 : 1.0);
        if (j < plays && plays < many) {
            weight = hysteresis_number_stays(&job->hysteresis.number[j], variance);
            equations->moment[j] += -weight * job->moved[j];
        } else if (j < plays) {
            weight = stay_part_many * mean;
        }
        row[j] = 1.0;
        normal_equations_penalise(equations, row, weight);
        row[j] = 0.0;
    }
    free(row);
}

static void take_equations(job_t *job, double searched_part, normal_equations_t *equations, double *lower) {
    const size_t n = job->unknowns;
    normal_equations_create(equations, n);
    memcpy(equations->gram, job->gram, n * n * sizeof(double));
    normal_equations_of_columns(equations, job->matrix, job->residual, job->samples->fitted,
                                job->fresh ? 0 : job->hysteresis.count);
    memcpy(job->gram, equations->gram, n * n * sizeof(double));
    for (size_t i = 0; i < n; i++) {
        lower[i] = i < job->hysteresis.count ? fmin(0.0, job->hysteresis.number[i].least - job->moved[i]) : -HUGE_VAL;
    }
    stay_near(job, equations->power / (double)job->samples->fitted, searched_part, equations);
}

/* Damped by what stay_near adds. */
static bool solve(void *context, double damping, double *change) {
    job_t *job = context;
    (void)damping;
    normal_equations_t equations;
    double *lower = allocate(job->unknowns, sizeof(double));
    failure_t refusal;
    take_equations(job, step_part, &equations, lower);
    const bool good = solve_bounded(&equations, lower, change, NULL, &refusal);
    normal_equations_free(&equations);
    free(lower);
    return good;
}

static double move(void *context, const double *change, double part) {
    job_t *job = context;
    failure_t refusal;
    size_t at = job->hysteresis.count;
    hysteresis_numbers_keep(&job->hysteresis);
    for (size_t i = 0; i < job->hysteresis.count; i++) {
        hysteresis_number_add(&job->hysteresis.number[i], part * change[i]);
        job->moved[i] += part * change[i];
    }
    for (size_t b = 0; b < job->blocks; b++) {
        searched_move(&job->searched[b], change + at, part);
        at += job->searched[b].count;
    }
    return model_check(job->model, "model", &refusal) && take_power(job, &job->tried, &refusal) ? job->tried.fitted
                                                                                                : HUGE_VAL;
}

static void move_back(void *context, const double *change, double part) {
    job_t *job = context;
    hysteresis_numbers_restore(&job->hysteresis);
    for (size_t i = 0; i < job->hysteresis.count; i++) {
        job->moved[i] -= part * change[i];
    }
    for (size_t b = 0; b < job->blocks; b++) {
        searched_back(&job->searched[b]);
    }
}

static void keep(void *context) {
    job_t *job = context;
    *job->power = job->tried;
}

static bool linearise(void *context, double *cost) {
    job_t *job = context;
    signals_t signals;
    failure_t refusal;
    if (!signals_open(&signals, job->samples, job->model, &refusal)) {
        return false;
    }
    take_residual(job, signals.simulated, job->power);
    *cost = job->power->fitted;
    take_matrix(job, &signals);
    signals_close(&signals);
    return true;
}

/* Not before the hysteresis' columns are those of the model as it is. */
static bool ends(void *context, bool improved, double before, double now) {
    job_t *job = context;
    const bool settled = !improved || (before - now) * (double)job->samples->fitted < settled_likelihood * now;
    if (settled && job->fresh) {
        return true;
    }
    job->uses = job->fresh ? 1 : job->uses + 1;
    job->fresh = !job->linear || settled || job->uses >= most_uses;
    return false;
}

/* A converter's steps stand at the end of a chain, and are in no fit: behind them a small change of a number is none,
 * or a whole step. Until close_job the model is without them. */
static size_t set_steps_aside(model_t *model) {
    size_t count = 0;
    while (model->blocks > 0 && model->block[model->blocks - 1].block->readings == READINGS_STEPPED) {
        model->blocks--;
        count++;
    }
    return count;
}

static void open_job(job_t *job, const samples_t *samples, const noise_t *noise, model_t *model, unsigned blocks) {
    *job =
        (job_t){.samples = samples, .noise = noise, .model = model, .set_aside = set_steps_aside(model), .fresh = true};
    past_open(&job->past, samples, noise);
    hysteresis_numbers_open(model, &job->hysteresis);
    job->unknowns = job->hysteresis.count;
    for (size_t b = 0; b < model->blocks; b++) {
        if ((blocks >> b & 1U) != 0) {
            searched_open(&job->searched[job->blocks], model, b,
                          recordings_held_s(samples->recordings, samples->count));
            job->unknowns += job->searched[job->blocks].count;
            job->block[job->blocks++] = b;
        }
    }
    job->moved = allocate(job->hysteresis.count, sizeof(double));
    job->white = samples_column(samples);
    job->column = samples_column(samples);
    job->residual = allocate(samples->fitted, sizeof(double));
    job->held = allocate(samples->held, sizeof(double));
    job->matrix = allocate(job->unknowns * samples->fitted, sizeof(double));
    job->gram = allocate(job->unknowns * job->unknowns, sizeof(double));
}

static void close_job(job_t *job) {
    job->model->blocks += job->set_aside;
    past_close(&job->past);
    hysteresis_numbers_close(&job->hysteresis);
    free(job->moved);
    free(job->white);
    free(job->column);
    free(job->residual);
    free(job->held);
    free(job->matrix);
    free(job->gram);
}

unsigned joint_blocks(const model_t *model, const block_t *const *block, size_t count) {
    unsigned blocks = 0;
    for (size_t i = 0; i < count; i++) {
        const model_block_t *found = model_find(model, block[i]->name);
        blocks |= found != NULL ? 1U << (found - model->block) : 0U;
    }
    return blocks;
}

bool joint_fit(const samples_t *samples, const noise_t *noise, model_t *model, unsigned blocks, size_t iterations,
               joint_power_t *power, failure_t *failure) {
    job_t job;
    open_job(&job, samples, noise, model, blocks);
    job.power = power;
    job.linear = !hysteresis_numbers_few(job.hysteresis.count);
    const bool good = take_power(&job, power, failure);
    const gauss_newton_problem_t problem = {&job, job.unknowns, linearise, solve, move, move_back, keep, ends};
    gauss_newton_tunables_t tuned = tunables;
    tuned.most_iterations = !job.linear                    ? iterations * few_iterations
                            : job.hysteresis.count >= many ? (iterations + 1) / 2
                                                           : iterations;
    double cost = power->fitted;
    if (good) {
        (void)gauss_newton(&problem, &tuned, &cost);
    }
    close_job(&job);
    return good;
}

/* So many neighbours of the whitened residual count as one. */
static double neighbours(const job_t *job) {
    const samples_t *samples = job->samples;
    residual_run_t *run = allocate(samples->all, sizeof *run);
    size_t runs = 0;
    double time;
    for (size_t k = 0, fitted = 0; k < samples->all; k++) {
        if (samples->part[k] == SAMPLE_FITTED) {
            if (k == 0 || samples->part[k - 1] != SAMPLE_FITTED) {
                run[runs++] = (residual_run_t){.value = job->residual + fitted};
            }
            run[runs - 1].samples++;
            fitted++;
        }
    }
    time = autocorrelation_time(run, runs);
    free(run);
    return time;
}

static void keep_error(parameter_t *parameter, size_t element, double sigma) {
    if (parameter->sigma == NULL) {
        parameter->sigma = allocate(parameter->count, sizeof(double));
    }
    parameter->sigma[element] = sigma;
}

static double error_of_searched(const searched_t *searched, size_t i, double sigma) {
    const double value = *searched->number[i], low = searched->low[i], high = searched->high[i];
    if (value <= low || value >= high) {
        return 0.0;
    }
    if (searched->logarithmic[i]) {
        return sigma < 1.0 ? sigma * value : HUGE_VAL;
    }
    return sigma * searched->scale[i] < 0.5 * (high - low) ? sigma * searched->scale[i] : HUGE_VAL;
}

/* A number that changes nothing has no error. */
static double error_of(const job_t *job, const double *covariance, double neighbours_as_one, size_t i) {
    const size_t diagonal = i * (job->unknowns + 1);
    return job->gram[diagonal] > 0.0 ? sqrt(neighbours_as_one * covariance[diagonal]) : HUGE_VAL;
}

static void keep_errors(job_t *job, const double *covariance, double neighbours_as_one) {
    size_t at = job->hysteresis.count;
    for (size_t i = 0; i < job->hysteresis.count; i++) {
        const hysteresis_number_t *number = &job->hysteresis.number[i];
        if (number->elements == 1) {
            keep_error(number->parameter, number->first, error_of(job, covariance, neighbours_as_one, i));
        }
    }
    for (size_t b = 0; b < job->blocks; b++) {
        for (size_t i = 0; i < job->searched[b].count; i++, at++) {
            const double sigma = error_of(job, covariance, neighbours_as_one, at);
            keep_error(job->searched[b].parameter[i], 0, error_of_searched(&job->searched[b], i, sigma));
        }
    }
}

bool joint_errors(const samples_t *samples, const noise_t *noise, model_t *model, unsigned blocks, failure_t *failure) {
    job_t job;
    signals_t signals;
    open_job(&job, samples, noise, model, blocks);
    bool good = signals_open(&signals, samples, model, failure);
    if (good) {
        const size_t n = job.unknowns;
        double *lower = allocate(n, sizeof(double)), *covariance = allocate(n * n, sizeof(double));
        bool *bound = allocate(n, sizeof(bool));
        normal_equations_t equations;
        joint_power_t power;
        take_residual(&job, signals.simulated, &power);
        take_matrix(&job, &signals);
        signals_close(&signals);
        take_equations(&job, error_part, &equations, lower);
        for (size_t i = 0; i < n; i++) {
            bound[i] = lower[i] == 0.0;
        }
        good = inverse_matrix(&equations, bound, covariance, failure);
        cblas_dscal((int)(n * n), power.fitted / (double)samples->fitted, covariance, 1);
        if (good) {
            keep_errors(&job, covariance, neighbours(&job));
        }
        normal_equations_free(&equations);
        free(bound);
        free(lower);
        free(covariance);
    }
    close_job(&job);
    return good;
}

bool joint_power(const samples_t *samples, const noise_t *noise, const model_t *model, joint_power_t *power,
                 failure_t *failure) {
    model_t copy;
    job_t job;
    model_copy(&copy, model);
    open_job(&job, samples, noise, &copy, 0);
    const bool good = take_power(&job, power, failure);
    close_job(&job);
    model_free(&copy);
    return good;
}

static size_t index_of_delay(const model_t *model) {
    size_t b = 0;
    while (b < model->blocks && model->block[b].block->lag != LAG_DELAY) {
        b++;
    }
    return b;
}

size_t joint_middle_of_same(const samples_t *samples, const noise_t *noise, model_t *model, double *same_s) {
    const double since = samples->recordings[0].held_since;
    const size_t at = index_of_delay(model);
    joint_power_t here, there;
    failure_t refusal;
    double whole;
    *same_s = recordings_held_s(samples->recordings, samples->count);
    if (at == model->blocks || *same_s <= 0.0 || !joint_power(samples, noise, model, &here, &refusal)) {
        return model->blocks;
    }
    double *delay_s = model->block[at].parameter[0].value;
    const double before_s = *delay_s;
    (void)held_later(since, before_s / *same_s, &whole);
    *delay_s = fmax(0.0, whole - 0.5 + since) * *same_s;
    if (joint_power(samples, noise, model, &there, &refusal) && there.fitted == here.fitted) {
        return at;
    }
    *delay_s = before_s;
    return model->blocks;
}
