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
/* The columns pass through the memory once for all vectors x of a call: some at a time are much cheaper than one by
 * one, and more than these no cheaper. They stand one after the other, `rows` each. */
enum { BASIS_AT_ONCE = 16 };

/** Adds vectors in their order, except those of which the columns before leave less than 1e-6. They are changed. */
void basis_add(basis_t *basis, double *x, size_t count);

/** Vectors that wait, to be added BASIS_AT_ONCE at a time. */
typedef struct {
    basis_t *basis;
    size_t count;
    double *x;
} basis_queue_t;

void basis_queue_open(basis_queue_t *queue, basis_t *basis);
/** Where the next vector goes, which waits from then on. */
double *basis_queue_next(basis_queue_t *queue);
/** Adds those that wait, in their order. */
void basis_queue_add(basis_queue_t *queue);
/** Adds those that wait. The basis stays. */
void basis_queue_close(basis_queue_t *queue);

/** share = what each column explains of the vectors: basis->columns for each, `stride` apart, as the vectors are. */
void basis_shares(const basis_t *basis, const double *x, size_t count, size_t stride, double *share);
/** Takes out of the vectors what the columns explain. */
void basis_project(const basis_t *basis, double *x, size_t count);

#endif
