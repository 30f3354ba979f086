/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "shape_judgement.h"
#include "least_squares.h"
#include "nuisance.h"
#include <gsl/gsl_cblas.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A further step is worth it while the sum of squares falls below this part. */
static const double settled = 0.999;
/* Keeps numbers finite that the samples say nothing about. */
static const double small_weight = 1e-9;

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

/* Sum of squares that the last column keeps among the held-out samples when the others are fitted to it. change: of the
 * numbers of the hysteresis, which stand behind the offsets. */
static double held_out_power(const rows_t *rows, size_t offsets, size_t numbers, double *change) {
    const size_t n = rows->columns - 1;
    const int held = (int)rows->samples->held;
    double *x = allocate(n, sizeof(double)), *lower = allocate(n, sizeof(double)), *unit = allocate(n, sizeof(double));
    double *left = rows->held + n * rows->samples->held, power = HUGE_VAL;
    normal_equations_t equations;
    failure_t singular;
    normal_equations_create(&equations, n);
    normal_equations_of_columns(&equations, rows->fitted, rows->fitted + n * rows->samples->fitted,
                                rows->samples->fitted, 0);
    for (size_t i = 0; i < n; i++) {
        lower[i] = -HUGE_VAL;
    }
    for (size_t i = 0; i < n; i++) {
        const double own = equations.gram[i * n + i];
        unit[i] = 1.0;
        normal_equations_penalise(&equations, unit, own > 0.0 ? small_weight * own : 1.0);
        unit[i] = 0.0;
    }
    if (solve_bounded(&equations, lower, x, NULL, &singular)) {
        cblas_dgemv(CblasColMajor, CblasNoTrans, held, (int)n, -1.0, rows->held, held, x, 1, 1.0, left, 1);
        power = cblas_ddot(held, left, 1, left, 1);
        memcpy(change, x + offsets, numbers * sizeof(double));
    }
    normal_equations_free(&equations);
    free(x);
    free(lower);
    free(unit);
    return power;
}

/* What a shape leaves of the held-out samples together with the signatures; and the change of its numbers that it
 * takes. HUGE_VAL: it cannot be simulated. */
static double judge_once(const samples_t *samples, const noise_t *noise, const model_t *model, double **signature,
                         size_t signatures, size_t numbers, double *change) {
    const nuisance_options_t options = {0};
    rows_t rows = {.samples = samples, .noise = noise, .white = samples_column(samples)};
    double power = HUGE_VAL;
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
        power = held_out_power(&rows, samples->count, numbers, change);
        free(residual);
        signals_close(&signals);
    }
    free(rows.white);
    free(rows.fitted);
    free(rows.held);
    return power;
}

double shape_judgement(const samples_t *samples, const noise_t *noise, model_t *model, double **signature,
                       size_t signatures) {
    enum { STEPS = 4 };
    hysteresis_numbers_t numbers;
    hysteresis_numbers_open(model, &numbers);
    double *change = allocate(numbers.count, sizeof(double));
    double *ignored = allocate(numbers.count, sizeof(double));
    double least = judge_once(samples, noise, model, signature, signatures, numbers.count, change);
    for (int step = 0; step < STEPS && hysteresis_numbers_few(numbers.count) && isfinite(least); step++) {
        failure_t refusal;
        hysteresis_numbers_keep(&numbers);
        for (size_t i = 0; i < numbers.count; i++) {
            hysteresis_number_add(&numbers.number[i], change[i]);
        }
        const double power = model_check(model, "model", &refusal)
                                 ? judge_once(samples, noise, model, signature, signatures, numbers.count, ignored)
                                 : HUGE_VAL;
        if (!(power < settled * least)) {
            hysteresis_numbers_restore(&numbers);
            break;
        }
        least = power;
        memcpy(change, ignored, numbers.count * sizeof(double));
    }
    hysteresis_numbers_close(&numbers);
    free(change);
    free(ignored);
    return least;
}
