/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "identify/preisach_fit.h"
#include "numerics/autocorrelation.h"
#include "numerics/least_squares.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Of the smoothness along the diagonal. */
static const double across_part = 0.01;
/* Of the whole range: an element with a larger standard error counts as not determined. */
static const double determined_part = 0.05;

/* The unknowns: weight of each cell (or the element itself), in the order of the table; offset; an offset for each span
 * with an unknown one. */
typedef struct {
    const preisach_grid_t *grid;
    bool of_elements;
    size_t cells, unknowns;
    size_t *offset_column; /* one a span */
    double center_um;      /* subtracted from the displacement, for the sake of conditioning */
} layout_t;

static layout_t make_layout(const preisach_grid_t *grid, const preisach_span_t *spans, size_t count) {
    layout_t layout = {
        .grid = grid, .cells = preisach_elements(grid->levels), .offset_column = allocate(count, sizeof(size_t))};
    layout.unknowns = layout.cells + 1;
    for (size_t s = 0; s < count; s++) {
        layout.offset_column[s] = spans[s].own_offset ? layout.unknowns++ : layout.cells;
    }
    layout.center_um = spans[0].recording->column[COLUMN_DISPLACEMENT][spans[0].from];
    return layout;
}

/* E(i,j) is the sum of the cells between the two levels, so a factor of E(i,j) is one of each cell (p,q) with p <= i, q
 * >= j: sums over i down and over j up, in place. */
static void factors_of_cells(size_t levels, double *row) {
    for (size_t i = levels - 1; i >= 1; i--) {
        for (size_t j = 0; j < i; j++) {
            double *here = &row[preisach_element(i, j)];
            if (i + 1 < levels) {
                *here += row[preisach_element(i + 1, j)];
            }
            if (j > 0) {
                *here += row[preisach_element(i, j - 1)];
            }
            if (i + 1 < levels && j > 0) {
                *here -= row[preisach_element(i + 1, j - 1)];
            }
        }
    }
}

/* The table from the cells, in place. */
static void table_of_cells(size_t levels, double *table) {
    for (size_t distance = 2; distance < levels; distance++) {
        for (size_t j = 0; j + distance < levels; j++) {
            const size_t i = j + distance;
            table[preisach_element(i, j)] += table[preisach_element(i - 1, j)] + table[preisach_element(i, j + 1)] -
                                             (distance > 2 ? table[preisach_element(i - 1, j + 1)] : 0.0);
        }
    }
}

void preisach_span_begin(const preisach_grid_t *grid, const preisach_span_t *span, preisach_memory_t *memory) {
    preisach_memory_begin(memory, grid);
    for (size_t k = 0; k < span->past; k++) {
        preisach_memory_move(memory, grid, span->past_v[k]);
    }
}

static void add_span(normal_equations_t *equations, const layout_t *layout, const preisach_span_t *span,
                     size_t offset_column, size_t stride) {
    double *row = allocate(layout->unknowns, sizeof(double));
    preisach_memory_t memory;
    preisach_span_begin(layout->grid, span, &memory);
    for (size_t k = 0; k < span->to; k++) {
        preisach_memory_move(&memory, layout->grid, span->recording->column[COLUMN_DRIVE][k]);
        if (k >= span->from && (k - span->from) % stride == 0) {
            memset(row, 0, layout->unknowns * sizeof(double));
            preisach_output_row(layout->grid, &memory, row);
            if (!layout->of_elements) {
                factors_of_cells(layout->grid->levels, row);
            }
            row[offset_column] = 1.0;
            normal_equations_add(equations, row, span->recording->column[COLUMN_DISPLACEMENT][k] - layout->center_um);
        }
    }
    free(row);
}

static void make_equations(normal_equations_t *equations, const layout_t *layout, const preisach_span_t *spans,
                           size_t count, const preisach_options_t *options) {
    size_t samples = 0, stride;
    for (size_t s = 0; s < count; s++) {
        samples += spans[s].to - spans[s].from;
    }
    stride = options->most_rows > 0 ? samples / options->most_rows + 1 : 1;
    normal_equations_create(equations, layout->unknowns);
    for (size_t s = 0; s < count; s++) {
        add_span(equations, layout, &spans[s], layout->offset_column[s], stride);
    }
    normal_equations_finish(equations);
}

static void penalise_difference(normal_equations_t *equations, double *row, size_t a, size_t b, double weight) {
    row[a] = 1.0;
    row[b] = -1.0;
    normal_equations_penalise(equations, row, weight);
    row[a] = row[b] = 0.0;
}

/* Neighbours along the diagonal alike, those across it less so. Weighted like the data's mean, so that `smoothing` does
 * not depend on their amount. */
static void add_smoothness(normal_equations_t *equations, const layout_t *layout, double smoothing) {
    const size_t last = layout->grid->levels - 1;
    double *row = allocate(layout->unknowns, sizeof(double)), data = 0.0;
    for (size_t c = 0; c < layout->cells; c++) {
        data += equations->gram[c * layout->unknowns + c] / (double)layout->cells;
    }
    for (size_t i = 1; i <= last; i++) {
        for (size_t j = 0; j < i; j++) {
            const size_t here = preisach_element(i, j);
            if (i < last) {
                penalise_difference(equations, row, here, preisach_element(i + 1, j + 1), smoothing * data);
            }
            if (i < last && i > j + 1) { /* triangles are of another kind than the squares beside them */
                penalise_difference(equations, row, here, preisach_element(i + 1, j), across_part * smoothing * data);
            }
        }
    }
    free(row);
}

static double *lower_bounds(const layout_t *layout, double least_slope) {
    const preisach_grid_t *grid = layout->grid;
    double *lower = allocate(layout->unknowns, sizeof(double)); /* 0 for the squares */
    for (size_t j = 0; j + 1 < grid->levels; j++) {
        lower[preisach_element(j + 1, j)] = least_slope * (grid->level_v[j + 1] - grid->level_v[j]);
    }
    for (size_t c = layout->cells; c < layout->unknowns; c++) {
        lower[c] = -HUGE_VAL;
    }
    return lower;
}

bool preisach_fit(const preisach_grid_t *grid, const preisach_span_t *spans, size_t count,
                  const preisach_options_t *options, preisach_fit_t *fit, failure_t *failure) {
    layout_t layout = make_layout(grid, spans, count);
    double *lower = lower_bounds(&layout, options->least_slope), *x = allocate(layout.unknowns, sizeof(double));
    normal_equations_t data, problem;
    bool solved;
    make_equations(&data, &layout, spans, count, options);
    problem = data;
    problem.gram = allocate(layout.unknowns * layout.unknowns, sizeof(double));
    memcpy(problem.gram, data.gram, layout.unknowns * layout.unknowns * sizeof(double));
    add_smoothness(&problem, &layout, options->smoothing);
    solved = solve_bounded(&problem, lower, x, NULL, failure);
    if (solved) {
        *fit = (preisach_fit_t){.elements = layout.cells,
                                .everett_um = allocate(layout.cells, sizeof(double)),
                                .offset_um = x[layout.cells] + layout.center_um,
                                .rms_um = sqrt(squared_error(&data, x) / (double)data.rows),
                                .rows = data.rows};
        memcpy(fit->everett_um, x, layout.cells * sizeof(double));
        table_of_cells(grid->levels, fit->everett_um);
    }
    free(problem.gram);
    normal_equations_free(&data);
    free(layout.offset_column);
    free(lower);
    free(x);
    return solved;
}

void preisach_predict(const preisach_grid_t *grid, const preisach_fit_t *fit, const preisach_span_t *span,
                      double *position_um) {
    preisach_memory_t memory;
    preisach_span_begin(grid, span, &memory);
    for (size_t k = 0; k < span->to; k++) {
        preisach_memory_move(&memory, grid, span->recording->column[COLUMN_DRIVE][k]);
        position_um[k] = preisach_output(grid, fit->everett_um, fit->offset_um, &memory);
    }
}

static double mean_of(const double *value, size_t count) {
    double sum = 0.0;
    for (size_t k = 0; k < count; k++) {
        sum += value[k] / (double)count;
    }
    return sum;
}

static double residual_autocorrelation(const preisach_grid_t *grid, const preisach_span_t *spans, size_t count,
                                       const preisach_fit_t *fit) {
    double **residual = allocate(count, sizeof *residual), samples;
    residual_run_t *run = allocate(count, sizeof *run);
    for (size_t s = 0; s < count; s++) {
        const preisach_span_t *span = &spans[s];
        double own = 0.0;
        residual[s] = allocate(span->to, sizeof(double));
        preisach_predict(grid, fit, span, residual[s]);
        for (size_t k = 0; k < span->to; k++) {
            residual[s][k] = span->recording->column[COLUMN_DISPLACEMENT][k] - residual[s][k];
        }
        run[s] = (residual_run_t){.value = residual[s] + span->from, .samples = span->to - span->from};
        own = span->own_offset ? mean_of(run[s].value, run[s].samples) : 0.0;
        for (size_t k = span->from; k < span->to; k++) {
            residual[s][k] -= own;
        }
    }
    samples = autocorrelation_time(run, count);
    for (size_t s = 0; s < count; s++) {
        free(residual[s]);
    }
    free(residual);
    free(run);
    return samples;
}

bool preisach_fit_sigma(const preisach_grid_t *grid, const preisach_span_t *spans, size_t count,
                        const preisach_options_t *options, preisach_fit_t *fit, failure_t *failure) {
    layout_t layout = make_layout(grid, spans, count);
    double *covariance = allocate(layout.unknowns * layout.unknowns, sizeof(double));
    bool *bound = allocate(layout.unknowns, sizeof(bool)), good;
    normal_equations_t equations;
    layout.of_elements = true;
    make_equations(&equations, &layout, spans, count, options);
    good = inverse_matrix(&equations, bound, covariance, failure);
    if (good) {
        const double range = fit->everett_um[preisach_element(grid->levels - 1, 0)];
        double scale;
        fit->autocorrelation_samples = residual_autocorrelation(grid, spans, count, fit);
        scale = fit->rms_um * sqrt(fit->autocorrelation_samples);
        fit->sigma_um = allocate(layout.cells, sizeof(double));
        for (size_t c = 0; c < layout.cells; c++) {
            fit->sigma_um[c] = fmin(range, scale * sqrt(covariance[c * (layout.unknowns + 1)]));
            fit->determined += fit->sigma_um[c] < determined_part * range ? 1 : 0;
        }
        fit->offset_sigma_um = fmin(range, scale * sqrt(covariance[layout.cells * (layout.unknowns + 1)]));
    }
    normal_equations_free(&equations);
    free(layout.offset_column);
    free(covariance);
    free(bound);
    return good;
}

void preisach_fit_free(preisach_fit_t *fit) {
    free(fit->everett_um);
    free(fit->sigma_um);
    memset(fit, 0, sizeof *fit);
}
