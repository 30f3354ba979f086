/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Linear least squares with lower bounds on some of the unknowns, from the normal equations.
 *
 * Minimises |A x - b|^2 with x_i >= lower_i wherever lower_i is finite. The rows of A are never stored: they are added
 * block by block to A'A and A'b. The columns are scaled to unit length before solving, and 1e-12 of that is added to
 * the diagonal, so that a column that the data do not excite gets a small number instead of none.
 */
#ifndef LEAST_SQUARES_H
#define LEAST_SQUARES_H

#include "failure.h"
#include <stddef.h>

typedef struct {
    size_t unknowns;
    size_t rows;    /**< added so far */
    double *gram;   /**< A'A, unknowns^2, symmetric */
    double *moment; /**< A'b */
    double power;   /**< b'b */
    /* rows that wait for the next block update */
    double *block;
    size_t waiting;
} normal_equations_t;

void normal_equations_create(normal_equations_t *equations, size_t unknowns);
void normal_equations_free(normal_equations_t *equations);

/** Adds one row: `row` has one element an unknown. */
void normal_equations_add(normal_equations_t *equations, const double *row, double value);

/** Products of all pairs of columns that stand one after the other, n * n of them. Of the first `known` columns they
 * are already there. On all processors. */
void products_of_columns(const double *columns, size_t rows, size_t n, size_t known, double *gram);

/** Instead of adding rows: all of them, as columns that stand one after the other. Nothing needs to be finished. Of the
 * first `known` columns the gram is already there. */
void normal_equations_of_columns(normal_equations_t *equations, const double *columns, const double *values,
                                 size_t rows, size_t known);

/** Must be called after the last row, before solving. */
void normal_equations_finish(normal_equations_t *equations);

/** Adds weight * (row' x)^2 to what is minimised. After normal_equations_finish. */
void normal_equations_penalise(normal_equations_t *equations, const double *row, double weight);

/**
 * Lawson and Hanson's active set method. x has one element an unknown; lower likewise, -HUGE_VAL for no bound.
 * bound[i] (may be NULL) says that x_i rests on its bound. Fails when the equations are singular beyond repair.
 */
bool solve_bounded(const normal_equations_t *equations, const double *lower, double *x, bool *bound,
                   failure_t *failure);

/** The same from columns that stand one after the other, one an unknown. lower NULL: no bounds. */
bool fit_columns(const double *columns, const double *values, size_t rows, size_t unknowns, const double *lower,
                 double *x, failure_t *failure);

/** Sum of squared residuals of x, from the equations. Not negative. */
double squared_error(const normal_equations_t *equations, const double *x);

/** The minimum with the unknowns of bound[] held at their value in x, which is left alone. */
bool solve_free(const normal_equations_t *equations, const bool *bound, const double *x, double *solution,
                failure_t *failure);

/** (A'A)^-1 over the unknowns that do not rest on a bound, unknowns^2 elements; rows and columns of the others are 0.
 */
bool inverse_matrix(const normal_equations_t *equations, const bool *bound, double *inverse, failure_t *failure);

#endif
