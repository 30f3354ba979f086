/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Least squares on columns some of which the others may make up, for many signals: the columns' products with each
 * other are factorised once.
 *
 * A is the columns, scaled to length 1 each by the diagonal S, and A'A = L L'. Of the products S A'y of a signal y,
 * w = L^-1 S A'y is white: |y|^2 - |w|^2 is what the columns leave of y, and S L'^-1 w are the coefficients.
 * A column that those before it make up to 1e-10 of its square has no part in it: its coefficient is 0.
 */
#ifndef COLUMN_FACTOR_H
#define COLUMN_FACTOR_H

#include <stdbool.h>
#include <stddef.h>

typedef struct {
    size_t columns;
    double *factor; /**< L, row by row */
    double *scale;  /**< S */
} column_factor_t;

/** Of column[i][row]. weight: one a row, 0 or more, or NULL. To be freed. */
void column_factor_make(column_factor_t *factor, const double *const *column, size_t columns, const double *weight,
                        size_t rows);
void column_factor_free(column_factor_t *factor);

/** false: the columns before this one make it up. */
bool column_factor_has(const column_factor_t *factor, size_t column);
/** Makes products of signals with the columns white, in place: of signal i those from products[i * stride] on. Many at
 * once are cheaper than one by one. */
void column_factor_whiten(const column_factor_t *factor, double *products, size_t signals, size_t stride);
/** Makes coefficients of white products, in place. */
void column_factor_solve(const column_factor_t *factor, double *white);

/** Adds `times` the columns, each with its coefficient, to a signal. */
void columns_add(const double *const *column, size_t columns, const double *coefficient, double times, size_t rows,
                 double *signal);

#endif
