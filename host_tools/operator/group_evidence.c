/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "operator/group_evidence.h"
#include "base/progress.h"
#include "thresholds/thresholds.h"
#include <gsl/gsl_blas.h>
#include <gsl/gsl_linalg.h>
#include <gsl/gsl_math.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_ROUNDS = 100 };
/* A precision for free columns, and for the round-off of the equations, in parts of the mean square of a column. */
static const double nearly_free = 1e-11;
/* A group that the data do not need is switched off here, relative to what a unit weight would explain. */
static const double switched_off = 1e12;
/* Numbers of a group that the data determine, below which it counts as switched off. */
static const double barely_used = 0.1;

static double dot(const double *a, const double *b, size_t count) {
    return cblas_ddot((int)count, a, 1, b, 1);
}

/* L L' = X'X + variance diag(precision); false where that is not positive. */
static bool factorise(const normal_equations_t *equations, const size_t *group, group_evidence_t *e) {
    const size_t n = e->columns;
    memcpy(e->factor, equations->gram, n * n * sizeof(double));
    for (size_t j = 0; j < n; j++) {
        e->factor[j * n + j] += e->variance * e->precision[group[j]] +
                                nearly_free * fmax(equations->gram[j * n + j], (double)equations->rows * 1e-6);
    }
    gsl_matrix_view matrix = gsl_matrix_view_array(e->factor, n, n);
    return gsl_linalg_cholesky_decomp1(&matrix.matrix) == 0;
}

static void solve(const normal_equations_t *equations, group_evidence_t *e) {
    const size_t n = e->columns;
    memcpy(e->weight, equations->moment, n * sizeof(double));
    cblas_dtrsv(CblasRowMajor, CblasLower, CblasNoTrans, CblasNonUnit, (int)n, e->factor, (int)n, e->weight, 1);
    cblas_dtrsv(CblasRowMajor, CblasLower, CblasTrans, CblasNonUnit, (int)n, e->factor, (int)n, e->weight, 1);
}

/* Diagonal of the inverse of L L': the squares of the columns of L^-1. */
static void inverse_diagonal(const group_evidence_t *e, double *inverse, double *diagonal) {
    const size_t n = e->columns;
    memcpy(inverse, e->factor, n * n * sizeof(double));
    gsl_matrix_view matrix = gsl_matrix_view_array(inverse, n, n);
    gsl_linalg_tri_invert(CblasLower, CblasNonUnit, &matrix.matrix);
    memset(diagonal, 0, n * sizeof(double));
    for (size_t i = 0; i < n; i++) {
        for (size_t j = 0; j <= i; j++) {
            diagonal[j] += inverse[i * n + j] * inverse[i * n + j];
        }
    }
}

static double misfit(const normal_equations_t *equations, const group_evidence_t *e, double *room) {
    const size_t n = e->columns;
    cblas_dsymv(CblasRowMajor, CblasLower, (int)n, 1.0, equations->gram, (int)n, e->weight, 1, 0.0, room, 1);
    return fmax(equations->power - 2.0 * dot(e->weight, equations->moment, n) + dot(e->weight, room, n), 0.0);
}

/* One step of the fixed point. Returns the largest change of a precision, as a logarithm; one that only grows, of a
 * group that is out of use, is none. */
static double step(const normal_equations_t *equations, const size_t *group, const size_t *count, bool find_variance,
                   group_evidence_t *e, double *inverse, double *diagonal) {
    const size_t n = e->columns;
    double open[EVIDENCE_MOST_GROUPS] = {0}, square[EVIDENCE_MOST_GROUPS] = {0}, determined = 0.0, change = 0.0;
    solve(equations, e);
    inverse_diagonal(e, inverse, diagonal);
    for (size_t j = 0; j < n; j++) {
        open[group[j]] += diagonal[j] * e->variance;
        square[group[j]] += e->weight[j] * e->weight[j];
    }
    for (size_t g = 0; g < e->groups; g++) {
        e->determined[g] = (double)count[g] - (g > 0 ? e->precision[g] * open[g] : 0.0);
        determined += e->determined[g];
        if (g > 0 && count[g] > 0) {
            const double better =
                fmin(fmax(e->determined[g], 1e-6) / fmax(square[g], 1e-300), switched_off / e->variance);
            const bool leaves = e->determined[g] < threshold.group_leaves && better > e->precision[g];
            change = fmax(change, leaves ? 0.0 : fabs(log(better / e->precision[g])));
            e->precision[g] = better;
        }
    }
    if (find_variance) {
        e->variance = fmax(misfit(equations, e, diagonal), 1e-14 * equations->power) /
                      fmax((double)equations->rows - determined, 1.0);
    }
    return change;
}

static double log_evidence(const normal_equations_t *equations, const size_t *count, const size_t *group,
                           const group_evidence_t *e, double *room) {
    const double rows = (double)equations->rows;
    double sum = -misfit(equations, e, room) / (2.0 * e->variance) - 0.5 * rows * log(2.0 * M_PI * e->variance);
    for (size_t j = 0; j < e->columns; j++) {
        const double precision = e->precision[group[j]];
        sum -= 0.5 * precision * e->weight[j] * e->weight[j] + log(e->factor[j * e->columns + j] / sqrt(e->variance));
    }
    for (size_t g = 1; g < e->groups; g++) {
        sum += 0.5 * (double)count[g] * log(e->precision[g]);
    }
    return sum;
}

/* A group that was switched off begins like a new one: there the fixed point hardly moves. */
static void begin_with(const group_evidence_t *start, group_evidence_t *e, bool find_variance) {
    for (size_t g = 1; g < e->groups; g++) {
        if (start->determined[g] > barely_used) {
            e->precision[g] = start->precision[g];
        }
    }
    if (find_variance) {
        e->variance = start->variance;
    }
}

bool group_evidence_fit(const normal_equations_t *equations, const size_t *group, size_t groups, double variance,
                        const group_evidence_t *start, group_evidence_t *e, failure_t *failure) {
    const size_t n = equations->unknowns;
    size_t count[EVIDENCE_MOST_GROUPS] = {0};
    double trace[EVIDENCE_MOST_GROUPS] = {0};
    if (equations->rows == 0) {
        return fail(failure, "no samples to fit");
    }
    *e = (group_evidence_t){.columns = n, .groups = groups};
    e->weight = allocate(n, sizeof(double));
    e->factor = allocate(n * n, sizeof(double));
    double *inverse = allocate(n * n, sizeof(double)), *diagonal = allocate(n, sizeof(double));
    for (size_t j = 0; j < n; j++) {
        count[group[j]]++;
        trace[group[j]] += equations->gram[j * n + j];
    }
    const double power = fmax(equations->power, 1e-300);
    e->variance = variance > 0.0 ? variance : 1e-4 * power / (double)equations->rows;
    for (size_t g = 1; g < groups; g++) { /* at first each group may explain a hundredth of everything */
        e->precision[g] = fmax(trace[g], 1e-300) / (0.01 * power);
    }
    e->precision[EVIDENCE_LEFT_OUT] = switched_off * fmax(trace[EVIDENCE_LEFT_OUT], 1e-300) / power;
    if (start != NULL && start->columns > 0) {
        begin_with(start, e, variance <= 0.0);
    }
    bool good = factorise(equations, group, e);
    for (int round = 0; good && round < MOST_ROUNDS; round++) {
        const double change = step(equations, group, count, variance <= 0.0, e, inverse, diagonal);
        good = !progress_cancelled() && factorise(equations, group, e);
        if (change < threshold.evidence_settled) {
            break;
        }
    }
    if (good) {
        solve(equations, e);
        e->log_evidence = log_evidence(equations, count, group, e, diagonal);
    }
    free(inverse);
    free(diagonal);
    if (!good) {
        group_evidence_free(e);
        return fail(failure, "the equations of the hysteresis cannot be solved");
    }
    return true;
}

void group_evidence_free(group_evidence_t *e) {
    free(e->weight);
    free(e->factor);
    *e = (group_evidence_t){0};
}

void group_evidence_open(const group_evidence_t *e, double *row, size_t rows, double *part) {
    const int n = (int)e->columns;
    cblas_dtrsm(CblasRowMajor, CblasRight, CblasLower, CblasTrans, CblasNonUnit, (int)rows, n, 1.0, e->factor, n, row,
                n);
    for (size_t i = 0; i < rows; i++) {
        part[i] = dot(row + i * e->columns, row + i * e->columns, e->columns);
    }
}
