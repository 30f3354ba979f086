/* SPDX-License-Identifier: GPL-3.0-or-later */
/** An orthonormal basis built up one column at a time, the projection of vectors onto it, and their residuals. */
#ifndef BASIS_H
#define BASIS_H

#include <stddef.h>

typedef struct {
    size_t rows, columns, most;
    double *column; /**< contiguous, `rows` each; the first `columns` of them are in use */
} basis_t;

void basis_open(basis_t *basis, size_t rows, size_t most);
void basis_close(basis_t *basis);
/* A call reads the columns from memory once for all its vectors x, so a batch is much cheaper than single vectors.
 * Larger batches than this gain nothing. The vectors are contiguous, `rows` elements each. */
enum { BASIS_AT_ONCE = 16 };

/** Adds vectors in order, except those whose residual against the earlier columns is below 1e-6. Overwrites x. */
void basis_add(basis_t *basis, double *x, size_t count);

/** A queue of vectors that are added BASIS_AT_ONCE at a time. */
typedef struct {
    basis_t *basis;
    size_t count;
    double *x;
} basis_queue_t;

void basis_queue_open(basis_queue_t *queue, basis_t *basis);
/** Room for the next vector, which is queued from then on. */
double *basis_queue_next(basis_queue_t *queue);
/** Adds the queued vectors in order. */
void basis_queue_add(basis_queue_t *queue);
/** Adds the queued vectors and frees the queue, not the basis. */
void basis_queue_close(basis_queue_t *queue);

/** share = the coefficient of each column in each vector: basis->columns per vector. Vectors, and their shares, are
 * `stride` elements apart. */
void basis_shares(const basis_t *basis, const double *x, size_t count, size_t stride, double *share);
/** Replaces the vectors by their residuals: subtracts the projection onto the columns. */
void basis_project(const basis_t *basis, double *x, size_t count);

#endif
