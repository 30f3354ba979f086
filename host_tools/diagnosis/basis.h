/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Orthonormal columns, one added after the other: what they explain of a vector, and what they leave. */
#ifndef BASIS_H
#define BASIS_H

#include <stddef.h>

typedef struct {
    size_t rows, columns, most;
    double *column; /**< one after the other; the first `columns` of them take part */
} basis_t;

void basis_open(basis_t *basis, size_t rows, size_t most);
void basis_close(basis_t *basis);
/** Adds a vector (rows), unless the columns leave less than 1e-6 of it. It is changed. */
void basis_add(basis_t *basis, double *x);
/** share = what each column explains of x; room for all columns. */
void basis_shares(const basis_t *basis, const double *x, double *share);
/** Takes out of x what the columns explain. */
void basis_project(const basis_t *basis, double *x);

#endif
