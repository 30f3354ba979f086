/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Least squares on fixed columns, of readings that are set right step by step: what look/path/changes.c tries its
 * instants with. For that file only. */
#ifndef LOOK_CHANGES_PROBLEM_H
#define LOOK_CHANGES_PROBLEM_H

#include "look/path/prediction.h"

/* Columns with their Gram matrix factorised; readings that are set right step by step. */
typedef struct {
    size_t n, columns, windows;
    const double *const *column; /* of rows 0 .. n - 1 */
    double *factor;              /* Cholesky, of scaled columns */
    double *scale;
    double *y;    /* readings, rows 0 .. n - 1, with EDGE more to either side */
    size_t *from; /* first row of each window; windows + 1 */
    size_t first; /* sample of row 0 */
    const prediction_t *prediction;
    double noise_um; /* of the readings */
} problem_t;

/** Factorises the Gram matrix of the columns; once for all readings. A column that the others make up gets 0. */
void problem_factorise(problem_t *p);
/** Factorised: those that the others do not make up, into column, which may be the problem's own. Returns how many. */
size_t problem_independent(const problem_t *p, const double **column);
/** L^-1 of scaled products of a signal with the columns: the square of it is what the columns explain. */
void problem_whiten(const problem_t *p, const double *products, double *white);
/** Products of a signal with the columns in each window: windows rows of columns + 1, the last its square. */
void problem_window_products(const problem_t *p, const double *signal, double *sums);
/** What the columns leave of the readings. Returns the sum of squares. */
double problem_residual(const problem_t *p, double *residual);
double problem_dot(const double *a, const double *b, size_t n);
/** log10 of the chance of the ratio of two sums of squares: -2 log of it times the independent samples is chi square of
 * `numbers`; its tail is bounded by exp(-x/2) (x/2)^(numbers/2 - 1). */
double problem_chance(double without, double with, const double *residual, size_t n, double numbers, double places);

#endif
