/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "look/path/changes_problem.h"
#include "numerics/autocorrelation.h"
#include <gsl/gsl_cblas.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double least_pivot = 1e-9, no_column = 1e150;

void problem_factorise(problem_t *p) {
    const size_t m = p->columns;
    look_products(p->column, m, NULL, p->n, p->factor);
    for (size_t i = 0; i < m; i++) {
        p->scale[i] = p->factor[i * m + i] > 0.0 ? 1.0 / sqrt(p->factor[i * m + i]) : 0.0;
    }
    for (size_t j = 0; j < m; j++) {
        double pivot = p->factor[j * m + j] * p->scale[j] * p->scale[j];
        for (size_t k = 0; k < j; k++) {
            pivot -= p->factor[j * m + k] * p->factor[j * m + k];
        }
        pivot = pivot > least_pivot ? sqrt(pivot) : no_column;
        p->factor[j * m + j] = pivot;
        for (size_t i = j + 1; i < m; i++) {
            double sum = p->factor[i * m + j] * p->scale[i] * p->scale[j];
            for (size_t k = 0; k < j; k++) {
                sum -= p->factor[i * m + k] * p->factor[j * m + k];
            }
            p->factor[i * m + j] = sum / pivot;
        }
    }
}

size_t problem_independent(const problem_t *p, const double **column) {
    size_t kept = 0;
    for (size_t c = 0; c < p->columns; c++) {
        if (p->factor[c * p->columns + c] < no_column) {
            column[kept++] = p->column[c];
        }
    }
    return kept;
}

/* L^-1 of scaled products of a signal with the columns: the square of it is what the columns explain. */
void problem_whiten(const problem_t *p, const double *products, double *white) {
    const int m = (int)p->columns;
    for (size_t i = 0; i < p->columns; i++) {
        white[i] = products[i] * p->scale[i];
    }
    cblas_dtrsv(CblasRowMajor, CblasLower, CblasNoTrans, CblasNonUnit, m, p->factor, m, white, 1);
}

double problem_dot(const double *a, const double *b, size_t n) {
    return cblas_ddot((int)n, a, 1, b, 1);
}

/* Products of a signal with the columns in each window: windows rows of columns + 1, the last its square. */
void problem_window_products(const problem_t *p, const double *signal, double *sums) {
    for (size_t w = 0; w < p->windows; w++) {
        const size_t from = p->from[w], count = p->from[w + 1] - from;
        for (size_t c = 0; c < p->columns; c++) {
            sums[w * (p->columns + 1) + c] = problem_dot(p->column[c] + from, signal + from, count);
        }
        sums[w * (p->columns + 1) + p->columns] = problem_dot(signal + from, signal + from, count);
    }
}

/* What the columns leave of the readings. Returns the sum of squares. */
double problem_residual(const problem_t *p, double *residual) {
    const size_t m = p->columns;
    double *products = allocate(m, sizeof *products), *x = allocate(m, sizeof *x), squares = 0.0;
    for (size_t c = 0; c < m; c++) {
        products[c] = problem_dot(p->column[c], p->y, p->n);
    }
    problem_whiten(p, products, x);
    cblas_dtrsv(CblasRowMajor, CblasLower, CblasTrans, CblasNonUnit, (int)m, p->factor, (int)m, x, 1);
    memcpy(residual, p->y, p->n * sizeof *residual);
    for (size_t c = 0; c < m; c++) {
        cblas_daxpy((int)p->n, -x[c] * p->scale[c], p->column[c], 1, residual, 1);
    }
    squares = problem_dot(residual, residual, p->n);
    free(products);
    free(x);
    return squares;
}

/* log10 of the chance of the ratio of two sums of squares: -2 log of it times the independent samples is chi square of
 * `numbers`; its tail is bounded by exp(-x/2) (x/2)^(numbers/2 - 1). */
double problem_chance(double without, double with, const double *residual, size_t n, double numbers, double places) {
    const residual_run_t run = {residual, n};
    const double half = 0.5 * (double)n / autocorrelation_time(&run, 1) * log(without / fmax(with, 1e-300));
    return (-half + fmax(0.0, 0.5 * numbers - 1.0) * log(fmax(1.0, half))) / log(10.0) + log10(places);
}
