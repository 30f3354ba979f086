/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "basis.h"
#include "failure.h"
#include <gsl/gsl_cblas.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double imitated = 1e-6;
/* A projection that leaves less than this part is done once more: rounding would be left behind. */
static const double much_taken = 0.5;

void basis_open(basis_t *basis, size_t rows, size_t most) {
    *basis = (basis_t){.rows = rows, .most = most, .column = allocate(rows * most, sizeof(double))};
}

void basis_close(basis_t *basis) {
    free(basis->column);
    *basis = (basis_t){0};
}

void basis_shares(const basis_t *basis, const double *x, double *share) {
    if (basis->columns > 0) {
        cblas_dgemv(CblasColMajor, CblasTrans, (int)basis->rows, (int)basis->columns, 1.0, basis->column,
                    (int)basis->rows, x, 1, 0.0, share, 1);
    }
}

void basis_project(const basis_t *basis, double *x) {
    double *share = allocate(basis->columns + 1, sizeof(double));
    double before = cblas_dnrm2((int)basis->rows, x, 1), after = 0.0;
    for (int pass = 0; pass < 3 && basis->columns > 0 && after < much_taken * before; pass++) {
        before = pass > 0 ? after : before;
        basis_shares(basis, x, share);
        cblas_dgemv(CblasColMajor, CblasNoTrans, (int)basis->rows, (int)basis->columns, -1.0, basis->column,
                    (int)basis->rows, share, 1, 1.0, x, 1);
        after = cblas_dnrm2((int)basis->rows, x, 1);
    }
    free(share);
}

void basis_add(basis_t *basis, double *x) {
    const double before = cblas_dnrm2((int)basis->rows, x, 1);
    basis_project(basis, x);
    const double after = cblas_dnrm2((int)basis->rows, x, 1);
    if (after > imitated * before && basis->columns < basis->most) {
        double *column = basis->column + basis->columns++ * basis->rows;
        memcpy(column, x, basis->rows * sizeof(double));
        cblas_dscal((int)basis->rows, 1.0 / after, column, 1);
    }
}
