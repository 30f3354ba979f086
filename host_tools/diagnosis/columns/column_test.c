/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/columns/column_test.h"
#include "diagnosis/evidence/candidate.h"
#include "diagnosis/nuisance/nuisance.h"
#include "diagnosis/nuisance/signals.h"
#include "numerics/basis.h"
#include "thresholds/thresholds.h"
#include <gsl/gsl_cblas.h>
#include <gsl/gsl_math.h>
#include <stdlib.h>
#include <string.h>

/* Fewer rows than this for each column of the nuisance subspace are explained by anything. */
static const size_t rows_per_column = 2;

/* The rows of fitted or of held-out samples. */
typedef struct {
    samples_part_t part;
    size_t rows;
    basis_t basis;        /* the nuisance subspace, and the half waves behind it */
    size_t drive_columns; /* of the nuisance subspace */
    double *residual;     /* whitened */
} rows_t;

struct column_test {
    const answer_t *answer;
    model_t model;
    signals_t signals;
    rows_t fitted, held;
    double *white;   /* a column */
    double found_um; /* what the findings change, whitened, beyond the nuisance subspace */
    double chance;
};

static void add_to_rows(rows_t *rows, const samples_t *samples, const double *white, nuisance_layer_t layer) {
    double *x = allocate(rows->rows, sizeof(double));
    samples_pick(samples, rows->part, white, x);
    basis_add(&rows->basis, x, 1);
    rows->drive_columns = layer == NUISANCE_TRENDS ? rows->drive_columns : rows->basis.columns;
    free(x);
}

static void add_column(void *context, const double *column, nuisance_layer_t layer) {
    column_test_t *test = context;
    const answer_t *answer = test->answer;
    noise_whiten(&answer->question->noise, &answer->question->samples, column, test->white);
    add_to_rows(&test->fitted, &answer->question->samples, test->white, layer);
    add_to_rows(&test->held, &answer->question->samples, test->white, layer);
}

static void open_rows(rows_t *rows, const signals_t *signals, samples_part_t part, size_t count,
                      const nuisance_options_t *options) {
    *rows = (rows_t){.part = part, .rows = count, .residual = allocate(count, sizeof(double))};
    basis_open(&rows->basis, count, nuisance_most(signals, options));
}

/* Takes out of rows what the nuisance subspace explains, or the nuisance subspace and the half waves. Returns the rows.
 */
static double *take_out(rows_t *rows, double *x, column_speed_t speed) {
    const size_t all = rows->basis.columns;
    rows->basis.columns = speed == TEST_FAST ? all : rows->drive_columns;
    basis_project(&rows->basis, x, 1);
    rows->basis.columns = all;
    return x;
}

static double *residual_beyond(rows_t *rows, column_speed_t speed) {
    double *y = allocate(rows->rows, sizeof(double));
    memcpy(y, rows->residual, rows->rows * sizeof(double));
    return take_out(rows, y, speed);
}

static double *column_beyond(column_test_t *test, rows_t *rows, const double *column, column_speed_t speed) {
    const answer_t *answer = test->answer;
    double *x = allocate(rows->rows, sizeof(double));
    noise_whiten(&answer->question->noise, &answer->question->samples, column, test->white);
    samples_pick(&answer->question->samples, rows->part, test->white, x);
    return take_out(rows, x, speed);
}

static double square_of(const rows_t *rows, const double *x) {
    return cblas_ddot((int)rows->rows, x, 1, x, 1);
}

static void take_residual(column_test_t *test) {
    const answer_t *answer = test->answer;
    double *residual = samples_column(&answer->question->samples);
    samples_residual(&answer->question->samples, test->signals.simulated, residual);
    noise_whiten(&answer->question->noise, &answer->question->samples, residual, test->white);
    samples_pick(&answer->question->samples, SAMPLE_FITTED, test->white, test->fitted.residual);
    samples_pick(&answer->question->samples, SAMPLE_HELD_OUT, test->white, test->held.residual);
    free(residual);
}

static bool measure_found(column_test_t *test, failure_t *failure) {
    const answer_t *answer = test->answer;
    double *change = samples_change(&answer->question->samples, &test->model, &answer->baseline, failure);
    const bool good = change != NULL;
    if (good) {
        double *left = column_beyond(test, &test->fitted, change, TEST_SLOW_TOO);
        test->found_um = sqrt(square_of(&test->fitted, left) / (double)test->fitted.rows);
        free(left);
    }
    free(change);
    return good;
}

column_test_t *column_test_open(const answer_t *answer, const model_t *model, double chance, failure_t *failure) {
    const nuisance_options_t options = {.past = true, .plays = true, .shapes = true, .trends = true};
    const samples_t *samples = &answer->question->samples;
    column_test_t *test = allocate(1, sizeof *test);
    *test = (column_test_t){.answer = answer, .chance = chance};
    model_copy(&test->model, model);
    model_without_noise(&test->model);
    test->white = samples_column(samples);
    bool good = signals_open(&test->signals, samples, &test->model, failure);
    if (good) {
        open_rows(&test->fitted, &test->signals, SAMPLE_FITTED, samples->fitted, &options);
        open_rows(&test->held, &test->signals, SAMPLE_HELD_OUT, samples->held, &options);
        nuisance(&test->signals, &options, add_column, test);
        good = measure_found(test, failure);
    }
    if (!good) {
        column_test_close(test);
        return NULL;
    }
    take_residual(test);
    return test;
}

void column_test_close(column_test_t *test) {
    if (test != NULL) {
        signals_close(&test->signals);
        model_free(&test->model);
        basis_close(&test->fitted.basis);
        basis_close(&test->held.basis);
        free(test->fitted.residual);
        free(test->held.residual);
        free(test->white);
        free(test);
    }
}

const model_t *column_test_model(const column_test_t *test) {
    return &test->model;
}

const double *column_test_simulated(const column_test_t *test) {
    return test->signals.simulated;
}

bool column_test_enough(const column_test_t *test) {
    return test->held.rows > rows_per_column * test->held.basis.columns;
}

column_trial_t column_try(column_test_t *test, const double *column, column_speed_t speed) {
    const double sigma_um = test->answer->question->noise.sigma_um;
    rows_t *held = &test->held;
    double *x = column_beyond(test, &test->fitted, column, speed), *y = residual_beyond(&test->fitted, speed);
    const regression_t found = regression_of(x, y, test->fitted.rows);
    free(x);
    free(y);
    x = column_beyond(test, held, column, speed);
    y = residual_beyond(held, speed);
    const double before = square_of(held, y);
    cblas_daxpy((int)held->rows, -found.amplitude, x, 1, y, 1);
    const double after = square_of(held, y);
    free(x);
    free(y);
    column_trial_t trial = {.coefficient = found.amplitude, .sigma = found.sigma, .least = HUGE_VAL};
    if (column_test_enough(test) && found.square > 0.0 && after > 0.0) {
        const double size = sqrt(found.square / (double)test->fitted.rows);
        const double least_um = fmax(threshold.least_size * sigma_um, threshold.least_part_of_found * test->found_um);
        trial.least = fmax(found.sigma * regression_quantile(&found, test->chance), least_um / size);
        trial.likelihood = gsl_pow_2(found.amplitude / sigma_um) * found.square;
        trial.share = 1.0 - after / before;
        trial.passed =
            fabs(found.amplitude) > trial.least && (double)held->rows * log(before / after) > threshold.least_support;
    }
    return trial;
}

double column_drift_share(column_test_t *test, const double *column) {
    rows_t *rows = &test->fitted;
    double *x = column_beyond(test, rows, column, TEST_SLOW_TOO), *y = residual_beyond(rows, TEST_SLOW_TOO);
    double *fast = residual_beyond(rows, TEST_FAST);
    const regression_t found = regression_of(x, y, rows->rows);
    const double drift = square_of(rows, y) - square_of(rows, fast);
    free(x);
    free(y);
    free(fast);
    return drift > 0.0 ? gsl_pow_2(found.amplitude) * found.square / drift : 0.0;
}

regression_t column_beside(column_test_t *test, const double *signature, const double *column) {
    rows_t *rows = &test->fitted;
    double *s = column_beyond(test, rows, signature, TEST_SLOW_TOO);
    double *x = column_beyond(test, rows, column, TEST_SLOW_TOO);
    double *y = residual_beyond(rows, TEST_SLOW_TOO);
    basis_t beside;
    basis_open(&beside, rows->rows, 1);
    basis_add(&beside, x, 1);
    cblas_daxpy((int)rows->rows, 1.0, s, 1, y, 1);
    basis_project(&beside, s, 1);
    basis_project(&beside, y, 1);
    const regression_t found = regression_of(s, y, rows->rows);
    basis_close(&beside);
    free(s);
    free(x);
    free(y);
    return found;
}
