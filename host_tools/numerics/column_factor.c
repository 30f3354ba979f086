/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "numerics/column_factor.h"
#include "numerics/least_squares.h"
#include <gsl/gsl_cblas.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A pivot so large that the coefficient is 0. */
static const double least_pivot = 1e-10, no_column = 1e150;

/* In blocks of rows, so that a copy of the weighted columns is small. */
static void add_products(const double *const *column, size_t columns, const double *weight, size_t rows, double *gram) {
    enum { BLOCK = 4096 };
    const size_t most = rows < BLOCK ? rows : BLOCK;
    double *block = allocate((columns + 1) * most, sizeof *block), *part = allocate(columns * columns, sizeof *part);
    double *root = block + columns * most;
    for (size_t from = 0; from < rows; from += most) {
        const size_t count = rows - from < most ? rows - from : most;
        for (size_t k = 0; k < count; k++) {
            root[k] = weight == NULL ? 1.0 : sqrt(weight[from + k]);
        }
        for (size_t i = 0; i < columns; i++) {
            for (size_t k = 0; k < count; k++) {
                block[i * count + k] = column[i][from + k] * root[k];
            }
        }
        products_of_columns(block, count, columns, 0, part);
        cblas_daxpy((int)(columns * columns), 1.0, part, 1, gram, 1);
    }
    free(block);
    free(part);
}

void column_factor_make(column_factor_t *f, const double *const *column, size_t columns, const double *weight,
                        size_t rows) {
    double *l = allocate(columns * columns, sizeof *l), *scale = allocate(columns, sizeof *scale);
    *f = (column_factor_t){columns, l, scale};
    add_products(column, columns, weight, rows, l);
    for (size_t i = 0; i < columns; i++) {
        scale[i] = l[i * columns + i] > 0.0 ? 1.0 / sqrt(l[i * columns + i]) : 0.0;
    }
    for (size_t i = 0; i < columns; i++) {
        double *const row = l + i * columns;
        for (size_t j = 0; j <= i; j++) {
            row[j] *= scale[i] * scale[j];
        }
        cblas_dtrsv(CblasRowMajor, CblasLower, CblasNoTrans, CblasNonUnit, (int)i, l, (int)columns, row, 1);
        const double rest = row[i] - cblas_ddot((int)i, row, 1, row, 1);
        row[i] = rest > least_pivot ? sqrt(rest) : no_column;
    }
}

void column_factor_free(column_factor_t *f) {
    free(f->factor);
    free(f->scale);
    memset(f, 0, sizeof *f);
}

bool column_factor_has(const column_factor_t *f, size_t column) {
    return f->factor[column * f->columns + column] < no_column;
}

void column_factor_whiten(const column_factor_t *f, double *products, size_t signals, size_t stride) {
    for (size_t s = 0; s < signals; s++) {
        for (size_t i = 0; i < f->columns; i++) {
            products[s * stride + i] *= f->scale[i];
        }
    }
    if (f->columns == 0 || signals == 0) { /* BLAS takes no empty matrix */
        return;
    }
    const int n = (int)f->columns;
    cblas_dtrsm(CblasRowMajor, CblasRight, CblasLower, CblasTrans, CblasNonUnit, (int)signals, n, 1.0, f->factor, n,
                products, (int)stride);
}

void column_factor_solve(const column_factor_t *f, double *white) {
    if (f->columns == 0) {
        return;
    }
    const int n = (int)f->columns;
    cblas_dtrsv(CblasRowMajor, CblasLower, CblasTrans, CblasNonUnit, n, f->factor, n, white, 1);
    for (size_t i = 0; i < f->columns; i++) {
        white[i] *= f->scale[i];
    }
}

void columns_add(const double *const *column, size_t columns, const double *coefficient, double times, size_t rows,
                 double *signal) {
    for (size_t c = 0; c < columns; c++) {
        cblas_daxpy((int)rows, times * coefficient[c], column[c], 1, signal, 1);
    }
}
