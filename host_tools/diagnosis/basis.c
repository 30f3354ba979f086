/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "basis.h"
#include "failure.h"
#include <gsl/gsl_cblas.h>
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

static const double imitated = 1e-6;
/* A projection that leaves less than this part is done once more: rounding would be left behind. */
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

void basis_shares(const basis_t *basis, const double *x, size_t count, size_t stride, double *share) {
    if (basis->columns > 0 && count == 1) {
        cblas_dgemv(CblasColMajor, CblasTrans, (int)basis->rows, (int)basis->columns, 1.0, basis->column,
                    (int)basis->rows, x, 1, 0.0, share, 1);
    } else if (basis->columns > 0 && count > 0) {
        cblas_dgemm(CblasColMajor, CblasTrans, CblasNoTrans, (int)basis->columns, (int)count, (int)basis->rows, 1.0,
                    basis->column, (int)basis->rows, x, (int)stride, 0.0, share, (int)stride);
    }
}

/* Once. One vector alone: OpenBLAS's product of matrices is slower than that of a matrix and a vector. */
static void project_once(const basis_t *basis, double *x, size_t count, double *share) {
    const int rows = (int)basis->rows, columns = (int)basis->columns, vectors = (int)count;
    if (count == 1) {
        cblas_dgemv(CblasColMajor, CblasTrans, rows, columns, 1.0, basis->column, rows, x, 1, 0.0, share, 1);
        cblas_dgemv(CblasColMajor, CblasNoTrans, rows, columns, -1.0, basis->column, rows, share, 1, 1.0, x, 1);
    } else {
        cblas_dgemm(CblasColMajor, CblasTrans, CblasNoTrans, columns, vectors, rows, 1.0, basis->column, rows, x, rows,
                    0.0, share, columns);
        cblas_dgemm(CblasColMajor, CblasNoTrans, CblasNoTrans, rows, vectors, columns, -1.0, basis->column, rows, share,
                    columns, 1.0, x, rows);
    }
}

/* Not more often than this, if it leaves little. */
static void project(const basis_t *basis, double *x, size_t count, int most_passes) {
    double *share = allocate(basis->columns * count, sizeof(double)), *before = allocate(count, sizeof(double));
    bool again = basis->columns > 0 && count > 0;
    for (size_t i = 0; i < count && most_passes > 1; i++) {
        before[i] = length_of(basis, x + i * basis->rows);
    }
    for (int pass = 1; again; pass++) {
        project_once(basis, x, count, share);
        again = false;
        for (size_t i = 0; i < count && pass < most_passes; i++) {
            const double after = length_of(basis, x + i * basis->rows);
            again = again || after < much_taken * before[i];
            before[i] = after;
        }
    }
    free(share);
    free(before);
}

void basis_project(const basis_t *basis, double *x, size_t count) {
    enum { MOST_PASSES = 3 };
    project(basis, x, count, MOST_PASSES);
}

/* Adds what the columns leave of each vector, if that is longer than least[i]. The vectors may stand where the next
 * columns go. */
static void add_what_is_left(basis_t *basis, double *x, size_t count, const double *least) {
    const size_t rows = basis->rows, known = basis->columns;
    project(basis, x, count, 1);
    for (size_t i = 0; i < count && basis->columns < basis->most; i++) {
        const basis_t added = {.rows = rows, .columns = basis->columns - known, .column = basis->column + known * rows};
        basis_project(&added, x + i * rows, 1);
        const double length = length_of(basis, x + i * rows);
        if (length > least[i]) {
            double *column = basis->column + basis->columns++ * rows;
            memmove(column, x + i * rows, rows * sizeof(double));
            cblas_dscal((int)rows, 1.0 / length, column, 1);
        }
    }
}

void basis_add(basis_t *basis, double *x, size_t count) {
    const size_t rows = basis->rows, known = basis->columns;
    double *least = allocate(count, sizeof(double));
    for (size_t i = 0; i < count; i++) {
        least[i] = imitated * length_of(basis, x + i * rows);
    }
    add_what_is_left(basis, x, count, least);
    /* Twice: where little of a vector was left, what rounding has left of the known columns is a large part of that;
     * and where it is all of that, hardly anything is left the second time. */
    const size_t added = basis->columns - known;
    for (size_t i = 0; i < added; i++) {
        least[i] = rounding;
    }
    basis->columns = known;
    add_what_is_left(basis, basis->column + known * rows, added, least);
    free(least);
}
