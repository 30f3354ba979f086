/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Least squares on fixed columns, of readings that are set right step by step: what instants
 * (look/path/changes_find.h) and clocks are tried with. For these only. */
#ifndef LOOK_CHANGES_PROBLEM_H
#define LOOK_CHANGES_PROBLEM_H

#include "look/path/changes.h"
#include "look/path/prediction.h"
#include "numerics/column_factor.h"

/** Readings that there are in front of the first row and behind the last one. */
enum { PROBLEM_EDGE = 4 * CHANGES_MOST_SHIFT };

typedef struct {
    size_t n, columns, windows;
    const double **column;  /**< of rows 0 .. n - 1 */
    column_factor_t factor; /**< of the columns */
    double *y;              /**< readings, rows 0 .. n - 1, with PROBLEM_EDGE more to either side */
    size_t *from;           /**< first row of each window; windows + 1 */
    size_t first;           /**< sample of row 0 */
    const prediction_t *prediction;
    double noise_um; /**< of the readings */
    double log_chance_limit;
} problem_t;

/** Factorises the columns; once for all readings. */
void problem_factorise(problem_t *p);

/** White products of a signal with the columns. Returns the square of what they leave of it. */
double problem_left(const problem_t *p, const double *signal, double *white);
/** What the columns leave of the readings. Returns its square. */
double problem_residual(const problem_t *p, double *residual);
/** Products of signals with the columns, and with others, in each window: of each signal, windows rows of columns +
 * others. Many signals at once cost little more than one. */
void problem_window_products(const problem_t *p, const double *const *signal, size_t signals,
                             const double *const *other, size_t others, double *sums);
double problem_dot(const double *a, const double *b, size_t n);
/** Root mean square of a sum of squares over all rows. */
double problem_rms(const problem_t *p, double squares);

/** Whether a window has as many on either side as an instant needs. */
bool problem_has_sides(const problem_t *p, size_t window);
/** The row from which on a change holds, of those from first to last. gains[row]: by how much the square of the row is
 * smaller with it; within: rows to either side at which the sum of all is as small, to `slack`. */
size_t problem_instant(const double *gains, size_t first, size_t last, double slack, size_t *within);

/** Readings, PROBLEM_EDGE more to either side; a copy of them to be freed. */
double *problem_copy(const problem_t *p);
void problem_keep(const problem_t *p, double *copy);
void problem_restore(problem_t *p, const double *copy);

/** log10 of the chance of the ratio of two sums of squares: -2 log of it times the independent samples is chi square of
 * `numbers`; its tail is bounded by exp(-x/2) (x/2)^(numbers/2 - 1). residual: of `with`. */
double problem_chance(const problem_t *p, double without, double with, const double *residual, double numbers,
                      double places);

#endif
