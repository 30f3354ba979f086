/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/evidence/shape_judgement.h"
#include "diagnosis/nuisance/hysteresis_numbers.h"
#include "diagnosis/nuisance/nuisance.h"
#include "numerics/gauss_newton.h"
#include "numerics/least_squares.h"
#include <gsl/gsl_cblas.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Whole steps, as long as they are worth it. */
static const gauss_newton_tunables_t tunables = {
    .most_iterations = 4, .most_trials = 1, .worth = 0.999, .shorten = 1.0};
/* Keeps amplitudes finite that the samples hardly say anything about. */
static const double small_weight = 1e-4;

static const joint_power_t nothing_simulated = {.fitted = HUGE_VAL, .held = HUGE_VAL};

/* Columns of one shape: whitened, the fitted and the held-out samples. */
typedef struct {
    const samples_t *samples;
    const noise_t *noise;
    size_t columns, most;
    double *white, *fitted, *held;
} rows_t;

static void add_rows(void *context, const double *column, nuisance_layer_t layer) {
    (void)layer;
    rows_t *rows = context;
    if (rows->columns < rows->most) {
        noise_whiten(rows->noise, rows->samples, column, rows->white);
        samples_pick(rows->samples, SAMPLE_FITTED, rows->white, rows->fitted + rows->columns * rows->samples->fitted);
        samples_pick(rows->samples, SAMPLE_HELD_OUT, rows->white, rows->held + rows->columns * rows->samples->held);
        rows->columns++;
    }
}

/* Sum of squares that the last of these columns keeps when x times the others is taken out of it. */
static double left_of(double *columns, size_t rows, size_t n, const double *x) {
    double *last = columns + n * rows;
    cblas_dgemv(CblasColMajor, CblasNoTrans, (int)rows, (int)n, -1.0, columns, (int)rows, x, 1, 1.0, last, 1);
    return cblas_ddot((int)rows, last, 1, last, 1);
}

/* What the samples hardly say anything about stays where it is: a number that shows in held-out samples alone, of whose
 * filters the fitted ones have a trace, would be anything. */
static void stay_near(const rows_t *rows, const hysteresis_numbers_t *numbers, normal_equations_t *equations) {
    const size_t n = rows->columns - 1, first = rows->samples->count; /* the numbers stand behind the offsets */
    const double variance = equations->power / (double)rows->samples->fitted;
    double *unit = allocate(n, sizeof(double));
    for (size_t i = 0; i < n; i++) {
        const double *held = rows->held + i * rows->samples->held;
        const double own = equations->gram[i * n + i] + cblas_ddot((int)rows->samples->held, held, 1, held, 1);
        const bool number = i >= first && i < first + numbers->count;
        unit[i] = 1.0;
        normal_equations_penalise(equations, unit,
                                  number      ? hysteresis_number_stays(&numbers->number[i - first], variance)
                                  : own > 0.0 ? small_weight * own
                                              : 1.0);
        unit[i] = 0.0;
    }
    free(unit);
}

/* What the last column keeps when the others are fitted to it. change: of the numbers of the hysteresis. */
static joint_power_t power_of(const rows_t *rows, const hysteresis_numbers_t *numbers, double *change) {
    const size_t n = rows->columns - 1;
    double *x = allocate(n, sizeof(double)), *lower = allocate(n, sizeof(double));
    joint_power_t power = nothing_simulated;
    normal_equations_t equations;
    failure_t singular;
    normal_equations_create(&equations, n);
    normal_equations_of_columns(&equations, rows->fitted, rows->fitted + n * rows->samples->fitted,
                                rows->samples->fitted, 0);
    for (size_t i = 0; i < n; i++) {
        lower[i] = -HUGE_VAL;
    }
    stay_near(rows, numbers, &equations);
    if (solve_bounded(&equations, lower, x, NULL, &singular)) {
        power.fitted = left_of(rows->fitted, rows->samples->fitted, n, x);
        power.held = left_of(rows->held, rows->samples->held, n, x);
        memcpy(change, x + rows->samples->count, numbers->count * sizeof(double));
    }
    normal_equations_free(&equations);
    free(x);
    free(lower);
    return power;
}

/* What a shape leaves together with the signatures; and the change of its numbers that it takes. */
static joint_power_t judge_once(const samples_t *samples, const noise_t *noise, const model_t *model,
                                double **signature, size_t signatures, bool past, const hysteresis_numbers_t *numbers,
                                double *change) {
    const nuisance_options_t options = {.past = past};
    rows_t rows = {.samples = samples, .noise = noise, .white = samples_column(samples)};
    joint_power_t power = nothing_simulated;
    signals_t signals;
    failure_t refusal;
    if (signals_open(&signals, samples, model, &refusal)) {
        rows.most = nuisance_most(&signals, &options) + signatures + 1;
        rows.fitted = allocate(rows.most * samples->fitted, sizeof(double));
        rows.held = allocate(rows.most * samples->held, sizeof(double));
        nuisance(&signals, &options, add_rows, &rows);
        double *residual = samples_column(samples);
        for (size_t i = 0; i < signatures; i++) {
            add_rows(&rows, signature[i], NUISANCE_TRENDS);
        }
        samples_residual(samples, signals.simulated, residual);
        add_rows(&rows, residual, NUISANCE_TRENDS);
        power = power_of(&rows, numbers, change);
        free(residual);
        signals_close(&signals);
    }
    free(rows.white);
    free(rows.fitted);
    free(rows.held);
    return power;
}

/* A shape and the signatures beside it. The equations at a point come with the judgement of it. */
typedef struct {
    const samples_t *samples;
    const noise_t *noise;
    model_t *model;
    double **signature;
    size_t signatures;
    bool past;
    hysteresis_numbers_t numbers;
    joint_power_t least, tried; /* where the model stands, and where it was moved to; likewise the steps there */
    double *change, *tried_change;
} shape_t;

static joint_power_t judge(shape_t *shape, double *change) {
    return judge_once(shape->samples, shape->noise, shape->model, shape->signature, shape->signatures, shape->past,
                      &shape->numbers, change);
}

static bool linearise(void *context, double *cost) {
    (void)context;
    (void)cost;
    return true;
}

static bool solve(void *context, double damping, double *step) {
    const shape_t *shape = context;
    (void)damping;
    memcpy(step, shape->change, shape->numbers.count * sizeof(double));
    return true;
}

static double move(void *context, const double *step, double part) {
    shape_t *shape = context;
    failure_t refusal;
    hysteresis_numbers_keep(&shape->numbers);
    for (size_t i = 0; i < shape->numbers.count; i++) {
        hysteresis_number_add(&shape->numbers.number[i], part * step[i]);
    }
    shape->tried = model_check(shape->model, "model", &refusal) ? judge(shape, shape->tried_change) : nothing_simulated;
    return shape->tried.held;
}

static void move_back(void *context, const double *step, double part) {
    shape_t *shape = context;
    (void)step;
    (void)part;
    hysteresis_numbers_restore(&shape->numbers);
}

static void keep(void *context) {
    shape_t *shape = context;
    shape->least = shape->tried;
    memcpy(shape->change, shape->tried_change, shape->numbers.count * sizeof(double));
}

static bool ends(void *context, bool improved, double before, double now) {
    (void)context;
    (void)before;
    (void)now;
    return !improved;
}

joint_power_t shape_judgement(const samples_t *samples, const noise_t *noise, model_t *model, double **signature,
                              size_t signatures, bool past) {
    shape_t shape = {.samples = samples,
                     .noise = noise,
                     .model = model,
                     .signature = signature,
                     .signatures = signatures,
                     .past = past};
    hysteresis_numbers_open(model, &shape.numbers);
    shape.change = allocate(shape.numbers.count, sizeof(double));
    shape.tried_change = allocate(shape.numbers.count, sizeof(double));
    shape.least = judge(&shape, shape.change);
    if (hysteresis_numbers_few(shape.numbers.count) && isfinite(shape.least.held)) {
        const gauss_newton_problem_t problem = {&shape, shape.numbers.count, linearise, solve,
                                                move,   move_back,           keep,      ends};
        double held = shape.least.held; /* what it is judged by; the steps are those of the fitted samples */
        (void)gauss_newton(&problem, &tunables, &held);
    }
    hysteresis_numbers_close(&shape.numbers);
    free(shape.change);
    free(shape.tried_change);
    return shape.least;
}
