/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Linear least squares with lower bounds on some of the unknowns, from the normal equations.
 *
 * Minimises |A x - b|^2 with x_i >= lower_i wherever lower_i is finite. The rows of A are never stored: they are added
 * block by block to A'A and A'b. The columns are scaled to unit length before solving, and 1e-12 of that is added to
 * the diagonal, so that a column that the data do not excite gets a small coefficient rather than an undefined one.
 */
#ifndef LEAST_SQUARES_H
#define LEAST_SQUARES_H

#include "base/failure.h"
#include <stddef.h>

typedef struct {
    size_t unknowns;
    size_t rows;    /**< added so far */
    double *gram;   /**< A'A, unknowns^2, symmetric */
    double *moment; /**< A'b */
    double power;   /**< b'b */
    /* rows collected for the next block update */
    double *block;
    size_t waiting;
} normal_equations_t;

void normal_equations_create(normal_equations_t *equations, size_t unknowns);
void normal_equations_free(normal_equations_t *equations);

/** Adds one row: `row` has one element per unknown. */
void normal_equations_add(normal_equations_t *equations, const double *row, double value);

/** Gram matrix of n contiguous columns, n * n elements. Those of the first `known` columns are already filled in. Runs
 * on all processors. */
void products_of_columns(const double *columns, size_t rows, size_t n, size_t known, double *gram);

/** The equations from contiguous columns, instead of row by row. normal_equations_finish is not needed. The Gram matrix
 * of the first `known` columns is already filled in. */
void normal_equations_of_columns(normal_equations_t *equations, const double *columns, const double *values,
                                 size_t rows, size_t known);

/** Must be called after the last row, before solving. */
void normal_equations_finish(normal_equations_t *equations);

/** Adds weight * (row' x)^2 to the cost. Call after normal_equations_finish. */
void normal_equations_penalise(normal_equations_t *equations, const double *row, double weight);

/**
 * The active-set method of Lawson and Hanson. x has one element per unknown, and so has lower: -HUGE_VAL for no bound.
 * bound[i] (may be NULL): x_i is on its bound. Fails when the equations are numerically singular.
 */
bool solve_bounded(const normal_equations_t *equations, const double *lower, double *x, bool *bound,
                   failure_t *failure);

/** The same from contiguous columns, one per unknown. lower NULL: no bounds. */
bool fit_columns(const double *columns, const double *values, size_t rows, size_t unknowns, const double *lower,
                 double *x, failure_t *failure);

/** Sum of squared residuals at x, from the normal equations. Not negative. */
double squared_error(const normal_equations_t *equations, const double *x);

/** The minimum with the unknowns of bound[] fixed at their values in x, which stay unchanged. */
bool solve_free(const normal_equations_t *equations, const bool *bound, const double *x, double *solution,
                failure_t *failure);

/** (A'A)^-1 over the unknowns that are not on a bound, unknowns^2 elements; rows and columns of the others are 0. */
bool inverse_matrix(const normal_equations_t *equations, const bool *bound, double *inverse, failure_t *failure);

#endif
