/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "numerics/basis.h"
#include "base/failure.h"
#include "base/parallel.h"
#include "base/progress.h"
#include <gsl/gsl_cblas.h>
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

static const double imitated = 1e-6;
/* A projection that leaves less than this fraction is repeated to remove rounding errors. */
static const double much_taken = 0.1;

/* Of a column. */
static const double rounding = 1e-3;

static double length_of(const basis_t *basis, const double *x) {
    return sqrt(cblas_ddot((int)basis->rows, x, 1, x, 1));
}

void basis_open(basis_t *basis, size_t rows, size_t most) {
    *basis = (basis_t){.rows = rows, .most = most, .column = allocate(rows * most, sizeof(double))};
}

void basis_close(basis_t *basis) {
    free(basis->column);
    *basis = (basis_t){0};
}

typedef struct {
    const basis_t *basis;
    const double *x; /* vectors, */
    double *left;    /* or NULL: what is left of them, in their place */
    size_t count, stride, parts;
    double *share; /* of each part: a column each, for every vector */
} product_t;

/* One vector alone: OpenBLAS's product of matrices is slower than that of a matrix and a vector. */
static void multiply_part(void *context, size_t part) {
    const product_t *p = context;
    const size_t from = parallel_part(p->basis->rows, part, p->parts);
    const size_t to = parallel_part(p->basis->rows, part + 1, p->parts), columns = p->basis->columns;
    const int rows = (int)(to - from), stride = (int)p->basis->rows;
    double *share = p->share + part * columns * p->count;
    if (p->count == 1) {
        cblas_dgemv(CblasColMajor, CblasTrans, rows, (int)columns, 1.0, p->basis->column + from, stride, p->x + from, 1,
                    0.0, share, 1);
    } else {
        cblas_dgemm(CblasColMajor, CblasTrans, CblasNoTrans, (int)columns, (int)p->count, rows, 1.0,
                    p->basis->column + from, stride, p->x + from, (int)p->stride, 0.0, share, (int)columns);
    }
}

static void take_out_part(void *context, size_t part) {
    const product_t *p = context;
    const size_t from = parallel_part(p->basis->rows, part, p->parts);
    const size_t to = parallel_part(p->basis->rows, part + 1, p->parts), columns = p->basis->columns;
    const int rows = (int)(to - from), stride = (int)p->basis->rows;
    if (p->count == 1) {
        cblas_dgemv(CblasColMajor, CblasNoTrans, rows, (int)columns, -1.0, p->basis->column + from, stride, p->share, 1,
                    1.0, p->left + from, 1);
    } else {
        cblas_dgemm(CblasColMajor, CblasNoTrans, CblasNoTrans, rows, (int)p->count, (int)columns, -1.0,
                    p->basis->column + from, stride, p->share, (int)columns, 1.0, p->left + from, (int)p->stride);
    }
}

/* Leaves the shares of all parts in those of the first; to be freed by the caller. */
static void multiply(product_t *p) {
    const size_t length = p->basis->columns * p->count;
    p->parts = parallel_parts((double)p->basis->rows * (double)length);
    p->share = allocate(p->parts * length, sizeof(double));
    parallel(p->parts, multiply_part, p);
    for (size_t part = 1; part < p->parts; part++) {
        cblas_daxpy((int)length, 1.0, p->share + part * length, 1, p->share, 1);
    }
}

void basis_shares(const basis_t *basis, const double *x, size_t count, size_t stride, double *share) {
    product_t product = {.basis = basis, .x = x, .count = count, .stride = stride};
    if (basis->columns > 0 && count > 0) {
        multiply(&product);
        for (size_t i = 0; i < count; i++) {
            memcpy(share + i * stride, product.share + i * basis->columns, basis->columns * sizeof(double));
        }
        free(product.share);
    }
}

static void project_once(const basis_t *basis, double *x, size_t count) {
    product_t product = {.basis = basis, .x = x, .left = x, .count = count, .stride = basis->rows};
    multiply(&product);
    parallel(product.parts, take_out_part, &product);
    free(product.share);
}

/* Not more often than this, if it leaves little. */
static void project(const basis_t *basis, double *x, size_t count, int most_passes) {
    double *before = allocate(count, sizeof(double));
    bool again = basis->columns > 0 && count > 0 && !progress_cancelled();
    for (size_t i = 0; i < count && most_passes > 1; i++) {
        before[i] = length_of(basis, x + i * basis->rows);
    }
    for (int pass = 1; again; pass++) {
        project_once(basis, x, count);
        again = false;
        for (size_t i = 0; i < count && pass < most_passes; i++) {
            const double after = length_of(basis, x + i * basis->rows);
            again = again || after < much_taken * before[i];
            before[i] = after;
        }
    }
    free(before);
}

void basis_project(const basis_t *basis, double *x, size_t count) {
    enum { MOST_PASSES = 3 };
    project(basis, x, count, MOST_PASSES);
}

/* The columns from `known` on, as a separate basis. */
static basis_t added_since(const basis_t *basis, size_t known) {
    return (basis_t){
        .rows = basis->rows, .columns = basis->columns - known, .column = basis->column + known * basis->rows};
}

/* A vector out of which the columns before `known` have been taken, if what the others leave of it is long enough. */
static void add_one(basis_t *basis, size_t known, double *x, double least) {
    const basis_t added = added_since(basis, known);
    basis_project(&added, x, 1);
    const double length = length_of(basis, x);
    if (length > least && basis->columns < basis->most) {
        double *column = basis->column + basis->columns++ * basis->rows;
        memmove(column, x, basis->rows * sizeof(double));
        cblas_dscal((int)basis->rows, 1.0 / length, column, 1);
    }
}

/* Adds vectors out of which all columns have been taken, each if it is longer than least[i] beside those added before:
 * a few, and what they leave of all that follow, so that most products are those of matrices. The vectors may stand
 * where the next columns go. */
static void add_what_is_left(basis_t *basis, double *x, size_t count, const double *least) {
    enum { FEW = 4 };
    for (size_t begin = 0; begin < count && !progress_cancelled(); begin += FEW) {
        const size_t known = basis->columns, end = count - begin < FEW ? count : begin + FEW;
        for (size_t i = begin; i < end; i++) {
            add_one(basis, known, x + i * basis->rows, least[i]);
        }
        const basis_t added = added_since(basis, known);
        basis_project(&added, x + end * basis->rows, count - end);
    }
}

void basis_add(basis_t *basis, double *x, size_t count) {
    const size_t rows = basis->rows, known = basis->columns;
    double *least = allocate(count, sizeof(double));
    for (size_t i = 0; i < count; i++) {
        least[i] = imitated * length_of(basis, x + i * rows);
    }
    project(basis, x, count, 1);
    add_what_is_left(basis, x, count, least);
    /* Twice: in a small residual, rounding leaves a large fraction of the known columns. If the residual is all
     * rounding, hardly anything remains after the second pass. */
    const size_t added = basis->columns - known;
    double *again = basis->column + known * rows;
    for (size_t i = 0; i < added; i++) {
        least[i] = rounding;
    }
    basis->columns = known;
    project(basis, again, added, 1);
    add_what_is_left(basis, again, added, least);
    free(least);
}

void basis_queue_open(basis_queue_t *queue, basis_t *basis) {
    *queue = (basis_queue_t){.basis = basis, .x = allocate(BASIS_AT_ONCE * basis->rows, sizeof(double))};
}

double *basis_queue_next(basis_queue_t *queue) {
    if (queue->count == BASIS_AT_ONCE) {
        basis_queue_add(queue);
    }
    return queue->x + queue->count++ * queue->basis->rows;
}

void basis_queue_add(basis_queue_t *queue) {
    basis_add(queue->basis, queue->x, queue->count);
    queue->count = 0;
}

void basis_queue_close(basis_queue_t *queue) {
    basis_queue_add(queue);
    free(queue->x);
    *queue = (basis_queue_t){0};
}
