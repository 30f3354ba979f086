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
    if (basis->columns > 0 && count > 0) {
        cblas_dgemm(CblasColMajor, CblasTrans, CblasNoTrans, (int)basis->columns, (int)count, (int)basis->rows, 1.0,
                    basis->column, (int)basis->rows, x, (int)stride, 0.0, share, (int)stride);
    }
}

/* Once, and the length of each vector afterwards. */
static void project_once(const basis_t *basis, double *x, size_t count, double *share, double *length) {
    const int rows = (int)basis->rows, columns = (int)basis->columns, vectors = (int)count;
    cblas_dgemm(CblasColMajor, CblasTrans, CblasNoTrans, columns, vectors, rows, 1.0, basis->column, rows, x, rows, 0.0,
                share, columns);
    cblas_dgemm(CblasColMajor, CblasNoTrans, CblasNoTrans, rows, vectors, columns, -1.0, basis->column, rows, share,
                columns, 1.0, x, rows);
    for (size_t i = 0; i < count; i++) {
        length[i] = length_of(basis, x + i * basis->rows);
    }
}

void basis_project(const basis_t *basis, double *x, size_t count) {
    double *share = allocate(basis->columns * count, sizeof(double));
    double *before = allocate(count, sizeof(double)), *after = allocate(count, sizeof(double));
    bool again = basis->columns > 0;
    for (size_t i = 0; i < count; i++) {
        before[i] = length_of(basis, x + i * basis->rows);
    }
    for (int pass = 0; pass < 3 && again; pass++) {
        project_once(basis, x, count, share, after);
        again = false;
        for (size_t i = 0; i < count; i++) {
            again = again || after[i] < much_taken * before[i];
            before[i] = after[i];
        }
    }
    free(share);
    free(before);
    free(after);
}

/* Adds what the columns leave of each vector, if that is longer than least[i]. The vectors may stand where the next
 * columns go. */
static void add_what_is_left(basis_t *basis, double *x, size_t count, const double *least) {
    const size_t rows = basis->rows, known = basis->columns;
    basis_project(basis, x, count);
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
    /* Twice: little of a vector may be left by its neighbours, and then what rounding left of the known columns is a
     * large part of it. */
    const size_t added = basis->columns - known;
    memset(least, 0, count * sizeof(double));
    basis->columns = known;
    add_what_is_left(basis, basis->column + known * rows, added, least);
    free(least);
}
