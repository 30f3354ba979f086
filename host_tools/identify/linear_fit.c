/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "identify/linear_fit.h"
#include "numerics/autocorrelation.h"
#include "numerics/least_squares.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Columns of the linear problem. The drive is counted from the middle of its range, which keeps the columns apart from
 * the offset. */
enum { OFFSET, DIRECT, FIRST_PLAY };

typedef struct {
    size_t operators, unknowns;
    bool drift;
    double center_v, center_um;
} layout_t;

static layout_t make_layout(const play_basis_t *basis, const fit_span_t *spans, size_t count, bool drift) {
    double low_v = HUGE_VAL, high_v = -HUGE_VAL, low_um = HUGE_VAL, high_um = -HUGE_VAL;
    for (size_t s = 0; s < count; s++) {
        for (size_t k = spans[s].from; k < spans[s].to; k++) {
            low_v = fmin(low_v, spans[s].recording->column[COLUMN_DRIVE][k]);
            high_v = fmax(high_v, spans[s].recording->column[COLUMN_DRIVE][k]);
            low_um = fmin(low_um, spans[s].recording->column[COLUMN_DISPLACEMENT][k]);
            high_um = fmax(high_um, spans[s].recording->column[COLUMN_DISPLACEMENT][k]);
        }
    }
    return (layout_t){.operators = basis->operators,
                      .unknowns = FIRST_PLAY + basis->operators + (drift ? 1 : 0),
                      .drift = drift,
                      .center_v = 0.5 * (low_v + high_v),
                      .center_um = 0.5 * (low_um + high_um)};
}

static double drift_decades(const fit_span_t *span, size_t k) {
    const double rate = span->recording->sample_rate_hz;
    return log10((0.1 + (double)k / rate) / (0.1 + (double)span->to / rate));
}

static void fill_row(const layout_t *layout, const fit_span_t *span, size_t k, const double *memory_v, double *row) {
    row[OFFSET] = 1.0;
    row[DIRECT] = span->recording->column[COLUMN_DRIVE][k] - layout->center_v;
    for (size_t i = 0; i < layout->operators; i++) {
        row[FIRST_PLAY + i] = memory_v[i] - layout->center_v;
    }
    if (layout->drift) {
        row[FIRST_PLAY + layout->operators] = drift_decades(span, k);
    }
}

static void add_span(normal_equations_t *equations, const play_basis_t *basis, const layout_t *layout,
                     const fit_span_t *span) {
    double *row = allocate(layout->unknowns, sizeof(double));
    play_walk_t walk;
    play_walk_begin(&walk, basis, span->recording, span->initial_v);
    for (size_t k = 0; k < span->to; k++) {
        play_walk_step(&walk);
        if (k >= span->from) {
            fill_row(layout, span, k, walk.memory_v, row);
            normal_equations_add(equations, row, span->recording->column[COLUMN_DISPLACEMENT][k] - layout->center_um);
        }
    }
    play_walk_end(&walk);
    free(row);
}

/* Second differences of w_1..w_n: a density without kinks. Weighted like the data, so that `smoothing` does not depend
 * on their amount. */
static void add_smoothing(normal_equations_t *equations, size_t operators, double smoothing) {
    const double data = equations->gram[DIRECT * equations->unknowns + DIRECT];
    double *row = allocate(equations->unknowns, sizeof(double));
    for (size_t i = 1; i + 1 < operators; i++) {
        row[FIRST_PLAY + i - 1] = 1.0;
        row[FIRST_PLAY + i] = -2.0;
        row[FIRST_PLAY + i + 1] = 1.0;
        normal_equations_penalise(equations, row, smoothing * data);
        row[FIRST_PLAY + i - 1] = 0.0;
    }
    free(row);
}

static void make_equations(normal_equations_t *equations, const play_basis_t *basis, const layout_t *layout,
                           const fit_span_t *spans, size_t count) {
    normal_equations_create(equations, layout->unknowns);
    for (size_t s = 0; s < count; s++) {
        add_span(equations, basis, layout, &spans[s]);
    }
    normal_equations_finish(equations);
}

static double *lower_bounds(const layout_t *layout, double least_direct) {
    double *lower = allocate(layout->unknowns, sizeof(double)); /* 0 for the weights */
    lower[OFFSET] = -HUGE_VAL;
    lower[DIRECT] = least_direct;
    if (layout->drift) {
        lower[FIRST_PLAY + layout->operators] = -HUGE_VAL;
    }
    return lower;
}

static void take_solution(const layout_t *layout, const double *x, linear_fit_t *fit) {
    *fit = (linear_fit_t){.operators = layout->operators, .weight = allocate(layout->operators + 1, sizeof(double))};
    fit->offset_um = x[OFFSET] + layout->center_um;
    memcpy(fit->weight, x + DIRECT, (layout->operators + 1) * sizeof(double));
    for (size_t i = 0; i <= layout->operators; i++) {
        fit->offset_um -= fit->weight[i] * layout->center_v;
    }
    fit->drift_um = layout->drift ? x[FIRST_PLAY + layout->operators] : 0.0;
}

bool linear_fit(const play_basis_t *basis, const fit_span_t *spans, size_t count, const linear_options_t *options,
                linear_fit_t *fit, failure_t *failure) {
    const layout_t layout = make_layout(basis, spans, count, options->drift);
    double *lower = lower_bounds(&layout, options->least_direct);
    double *x = allocate(layout.unknowns, sizeof(double));
    normal_equations_t data, problem;
    bool solved;
    make_equations(&data, basis, &layout, spans, count);
    problem = data;
    problem.gram = allocate(layout.unknowns * layout.unknowns, sizeof(double));
    memcpy(problem.gram, data.gram, layout.unknowns * layout.unknowns * sizeof(double));
    if (options->smoothing > 0.0) {
        add_smoothing(&problem, layout.operators, options->smoothing);
    }
    solved = solve_bounded(&problem, lower, x, NULL, failure);
    if (solved) {
        take_solution(&layout, x, fit);
        fit->samples = data.rows;
        fit->rms_um = sqrt(squared_error(&data, x) / (double)data.rows);
    }
    free(problem.gram);
    normal_equations_free(&data);
    free(lower);
    free(x);
    return solved;
}

void linear_fit_free(linear_fit_t *fit) {
    free(fit->weight);
    free(fit->weight_sigma);
    memset(fit, 0, sizeof *fit);
}

void linear_fit_predict(const play_basis_t *basis, const linear_fit_t *fit, const fit_span_t *span,
                        double *position_um) {
    play_walk_t walk;
    play_walk_begin(&walk, basis, span->recording, span->initial_v);
    for (size_t k = 0; k < span->to; k++) {
        double sum = fit->offset_um + fit->weight[0] * walk.drive[k];
        play_walk_step(&walk);
        for (size_t i = 0; i < fit->operators; i++) {
            sum += fit->weight[i + 1] * walk.memory_v[i];
        }
        position_um[k] = sum;
    }
    play_walk_end(&walk);
}

double linear_fit_drift(const linear_fit_t *fit, const fit_span_t *span, size_t k) {
    return fit->drift_um * drift_decades(span, k);
}

error_measure_t linear_fit_error(const play_basis_t *basis, const linear_fit_t *fit, const fit_span_t *span) {
    double *position = allocate(span->to, sizeof(double));
    error_measure_t error;
    linear_fit_predict(basis, fit, span, position);
    error = measure_error(span->recording->column[COLUMN_DISPLACEMENT] + span->from, position + span->from,
                          span->to - span->from);
    free(position);
    return error;
}

bool linear_fit_sigma(const play_basis_t *basis, const fit_span_t *spans, size_t count, const linear_options_t *options,
                      linear_fit_t *fit, double *autocorrelation_samples, failure_t *failure) {
    const layout_t layout = make_layout(basis, spans, count, options->drift);
    double **residual = allocate(count, sizeof *residual),
           *covariance = allocate(layout.unknowns * layout.unknowns, sizeof(double));
    residual_run_t *run = allocate(count, sizeof *run);
    bool *bound = allocate(layout.unknowns, sizeof(bool)), good;
    normal_equations_t equations;
    size_t free_unknowns = layout.unknowns;
    for (size_t s = 0; s < count; s++) {
        residual[s] = allocate(spans[s].to, sizeof(double));
        linear_fit_predict(basis, fit, &spans[s], residual[s]);
        for (size_t k = 0; k < spans[s].to; k++) {
            residual[s][k] = spans[s].recording->column[COLUMN_DISPLACEMENT][k] - residual[s][k] -
                             linear_fit_drift(fit, &spans[s], k);
        }
        run[s] = (residual_run_t){.value = residual[s] + spans[s].from, .samples = spans[s].to - spans[s].from};
    }
    *autocorrelation_samples = autocorrelation_time(run, count);
    for (size_t i = 0; i <= layout.operators; i++) {
        bound[DIRECT + i] = fit->weight[i] <= (i == 0 ? options->least_direct : 0.0);
        free_unknowns -= bound[DIRECT + i] ? 1 : 0;
    }
    make_equations(&equations, basis, &layout, spans, count);
    good = inverse_matrix(&equations, bound, covariance, failure);
    if (good) {
        const double freedom = fmax((double)fit->samples - (double)free_unknowns, 1.0);
        const double scale = fit->rms_um * sqrt((double)fit->samples / freedom * *autocorrelation_samples);
        fit->offset_sigma_um = scale * sqrt(covariance[OFFSET * layout.unknowns + OFFSET]);
        fit->weight_sigma = allocate(layout.operators + 1, sizeof(double));
        for (size_t i = 0; i <= layout.operators; i++) {
            fit->weight_sigma[i] = scale * sqrt(covariance[(DIRECT + i) * (layout.unknowns + 1)]);
        }
    }
    normal_equations_free(&equations);
    for (size_t s = 0; s < count; s++) {
        free(residual[s]);
    }
    free(residual);
    free(run);
    free(covariance);
    free(bound);
    return good;
}
