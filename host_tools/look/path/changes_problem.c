/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "look/path/changes_problem.h"
#include "base/parallel.h"
#include "numerics/autocorrelation.h"
#include "thresholds/thresholds.h"
#include <gsl/gsl_cblas.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

void problem_factorise(problem_t *p) {
    column_factor_free(&p->factor);
    column_factor_make(&p->factor, p->column, p->columns, NULL, p->n);
}

double problem_dot(const double *a, const double *b, size_t n) {
    return cblas_ddot((int)n, a, 1, b, 1);
}

double problem_rms(const problem_t *p, double squares) {
    return sqrt(squares / (double)p->n);
}

double problem_left(const problem_t *p, const double *signal, double *white) {
    for (size_t c = 0; c < p->columns; c++) {
        white[c] = problem_dot(p->column[c], signal, p->n);
    }
    column_factor_whiten(&p->factor, white, 1, p->columns);
    return problem_dot(signal, signal, p->n) - problem_dot(white, white, p->columns);
}

double problem_residual(const problem_t *p, double *residual) {
    double *coefficient = allocate(p->columns, sizeof *coefficient);
    problem_left(p, p->y, coefficient);
    column_factor_solve(&p->factor, coefficient);
    memcpy(residual, p->y, p->n * sizeof *residual);
    columns_add(p->column, p->columns, coefficient, -1.0, p->n, residual);
    free(coefficient);
    return problem_dot(residual, residual, p->n);
}

/* Windows side by side: each task writes the sums of one. */
typedef struct {
    const problem_t *p;
    const double *const *signal, *const *other;
    size_t signals, others;
    double *sums;
} window_products_t;

static void multiply_window(void *context, size_t window) {
    const window_products_t *products = context;
    const problem_t *p = products->p;
    const size_t from = p->from[window], count = p->from[window + 1] - from, width = p->columns + products->others;
    double *column = allocate((width + products->signals) * count, sizeof *column), *signal = column + width * count;
    for (size_t c = 0; c < width; c++) {
        const double *of_all = c < p->columns ? p->column[c] : products->other[c - p->columns];
        memcpy(column + c * count, of_all + from, count * sizeof *column);
    }
    for (size_t s = 0; s < products->signals; s++) {
        memcpy(signal + s * count, products->signal[s] + from, count * sizeof *signal);
    }
    cblas_dgemm(CblasRowMajor, CblasNoTrans, CblasTrans, (int)products->signals, (int)width, (int)count, 1.0, signal,
                (int)count, column, (int)count, 0.0, products->sums + window * width, (int)(p->windows * width));
    free(column);
}

void problem_window_products(const problem_t *p, const double *const *signal, size_t signals,
                             const double *const *other, size_t others, double *sums) {
    parallel(p->windows, multiply_window, &(window_products_t){p, signal, other, signals, others, sums});
}

bool problem_has_sides(const problem_t *p, size_t window) {
    const double least = threshold.least_side * (double)p->windows;
    return (double)window >= least && (double)(p->windows - window) >= least;
}

size_t problem_instant(const double *gains, size_t first, size_t last, double slack, size_t *within) {
    double sum = 0.0, least = 0.0;
    size_t best = first;
    for (size_t k = first; k < last; k++) {
        sum += gains[k];
        if (sum < least) {
            least = sum;
            best = k + 1;
        }
    }
    *within = 0;
    sum = 0.0;
    for (size_t k = first; k < last; k++) {
        sum += gains[k];
        if (sum < least + slack) {
            const size_t apart = k + 1 < best ? best - k - 1 : k + 1 - best;
            *within = apart > *within ? apart : *within;
        }
    }
    return best;
}

double *problem_copy(const problem_t *p) {
    double *copy = allocate(p->n + 2 * PROBLEM_EDGE, sizeof *copy);
    problem_keep(p, copy);
    return copy;
}

void problem_keep(const problem_t *p, double *copy) {
    memcpy(copy, p->y - PROBLEM_EDGE, (p->n + 2 * PROBLEM_EDGE) * sizeof *copy);
}

void problem_restore(problem_t *p, const double *copy) {
    memcpy(p->y - PROBLEM_EDGE, copy, (p->n + 2 * PROBLEM_EDGE) * sizeof *copy);
}

double problem_chance(const problem_t *p, double without, double with, const double *residual, double numbers,
                      double places) {
    const residual_run_t run = {residual, p->n};
    const double half = 0.5 * (double)p->n / autocorrelation_time(&run, 1) * log(without / fmax(with, 1e-300));
    return (-half + fmax(0.0, 0.5 * numbers - 1.0) * log(fmax(1.0, half))) / log(10.0) + log10(places);
}
