/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "operator/evidence_step.h"
#include "base/failure.h"
#include "thresholds/thresholds.h"
#include <gsl/gsl_blas.h>
#include <gsl/gsl_eigen.h>
#include <gsl/gsl_linalg.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Unknowns of Newton's step: the precisions, and the inverse of the variance. */
enum { MOST_UNKNOWNS = EVIDENCE_MOST_GROUPS + 1 };
/* A step of Newton's changes no number by more than this factor, as a logarithm. What a longer one would spoil costs a
 * round: the fixed point's step is taken in its place where the evidence falls. */
static const double longest_step = 2.0;

/* L^-1, and the diagonal of the inverse of L L': the squares of the columns of L^-1. */
static void invert(const group_evidence_t *e, double *inverse, double *diagonal) {
    const size_t n = e->columns;
    memcpy(inverse, e->factor, n * n * sizeof(double));
    gsl_matrix_view matrix = gsl_matrix_view_array(inverse, n, n);
    gsl_linalg_tri_invert(CblasLower, CblasNonUnit, &matrix.matrix);
    memset(diagonal, 0, n * sizeof(double));
    for (size_t i = 0; i < n; i++) {
        for (size_t j = 0; j <= i; j++) {
            diagonal[j] += inverse[i * n + j] * inverse[i * n + j];
        }
        memset(inverse + i * n + i + 1, 0, (n - i - 1) * sizeof(double));
    }
}

void evidence_here(const group_evidence_t *e, evidence_place_t *here) {
    here->variance = e->variance;
    memcpy(here->precision, e->precision, sizeof here->precision);
}

void evidence_covariance(const evidence_work_t *work, const group_evidence_t *e) {
    const size_t n = e->columns;
    memcpy(work->covariance, work->inverse, n * n * sizeof(double));
    gsl_matrix_view matrix = gsl_matrix_view_array(work->covariance, n, n);
    gsl_linalg_tri_LTL(&matrix.matrix);
}

double evidence_fixed_point(evidence_work_t *work, group_evidence_t *e, evidence_place_t *next) {
    double determined = 0.0, change = 0.0;
    invert(e, work->inverse, work->diagonal);
    memset(work->open, 0, sizeof work->open);
    memset(work->square, 0, sizeof work->square);
    for (size_t j = 0; j < e->columns; j++) {
        work->open[work->group[j]] += work->diagonal[j] * e->variance;
        work->square[work->group[j]] += e->weight[j] * e->weight[j];
    }
    evidence_here(e, next);
    for (size_t g = 0; g < e->groups; g++) {
        e->determined[g] = (double)work->count[g] - (g > 0 ? e->precision[g] * work->open[g] : 0.0);
        determined += e->determined[g];
        work->leaves[g] = false;
        if (g > 0 && work->count[g] > 0) {
            const double better =
                fmin(fmax(e->determined[g], 1e-6) / fmax(work->square[g], 1e-300), evidence_switched_off / e->variance);
            work->leaves[g] = e->determined[g] < threshold.group_leaves && better > e->precision[g];
            if (!work->leaves[g]) {
                change = fmax(change, fabs(log(better / e->precision[g])));
                next->precision[g] = better;
            }
        }
    }
    const double rows = (double)work->equations->rows;
    next->variance = work->find_variance
                         ? fmax(work->misfit, 1e-14 * work->equations->power) / fmax(rows - determined, 1.0)
                         : e->variance;
    return change;
}

/* Sums over the columns i of group g and j of group h, both scaled with the precisions a_g a_h: of S_ij^2, and of
 * w_i S_ij w_j, where S = variance (L L')^-1 is the covariance of the weights w. */
typedef struct {
    double size[EVIDENCE_MOST_GROUPS][EVIDENCE_MOST_GROUPS], along[EVIDENCE_MOST_GROUPS][EVIDENCE_MOST_GROUPS];
} between_t;

static void between_groups(const evidence_work_t *work, const group_evidence_t *e, between_t *between) {
    const size_t n = e->columns;
    evidence_covariance(work, e);
    memset(between, 0, sizeof *between);
    for (size_t i = 0; i < n; i++) {
        double *size = between->size[work->group[i]], *along = between->along[work->group[i]];
        for (size_t j = 0; j <= i; j++) {
            const double s = e->variance * work->covariance[i * n + j], once = j < i ? 1.0 : 0.5;
            size[work->group[j]] += once * s * s;
            along[work->group[j]] += once * e->weight[i] * s * e->weight[j];
        }
    }
    for (size_t g = 0; g < e->groups; g++) { /* the upper half of the matrix is the lower one's mirror image */
        for (size_t h = 0; h <= g; h++) {
            const double scale = e->precision[g] * e->precision[h];
            between->size[g][h] = between->size[h][g] = scale * (between->size[g][h] + between->size[h][g]);
            between->along[g][h] = between->along[h][g] = scale * (between->along[g][h] + between->along[h][g]);
        }
    }
}

/* Slope of the log evidence by the logarithms of the precisions and, last, of 1 / variance; bend: minus the matrix of
 * its second derivatives. With A = X'X / variance + D and w = A^-1 X'y / variance, dw/da_g = -S I_g w and dS/da_g = -S
 * I_g S, where I_g picks the columns of a group. */
static void derive(const evidence_work_t *work, const group_evidence_t *e, const between_t *between, double *slope,
                   double bend[MOST_UNKNOWNS][MOST_UNKNOWNS]) {
    const size_t groups = e->groups;
    double determined = e->determined[0], open = 0.0, sizes = 0.0, alongs = 0.0;
    for (size_t g = 1; g < groups; g++) {
        const double prior = e->precision[g] * work->square[g], left = e->precision[g] * work->open[g];
        double size = 0.0, along = 0.0;
        for (size_t h = 1; h < groups; h++) {
            bend[g][h] = -between->along[g][h] - 0.5 * between->size[g][h];
            size += between->size[g][h];
            along += between->along[g][h];
        }
        slope[g] = 0.5 * (e->determined[g] - prior);
        bend[g][g] += 0.5 * (prior + left);
        bend[g][groups] = bend[groups][g] = along - 0.5 * (left - size);
        determined += e->determined[g];
        open += left;
        sizes += size;
        alongs += along;
    }
    const double misfit = work->misfit / e->variance;
    slope[groups] = 0.5 * ((double)work->equations->rows - determined - misfit);
    bend[groups][groups] = 0.5 * (open - sizes + misfit) - alongs;
}

/* step = bend^-1 slope, uphill also where the evidence is bent upwards. */
static void step_uphill(size_t unknowns, double *bend, const double *slope, double *step) {
    double value[MOST_UNKNOWNS], vector[MOST_UNKNOWNS * MOST_UNKNOWNS], most = 0.0;
    gsl_matrix_view bends = gsl_matrix_view_array(bend, unknowns, unknowns),
                    vectors = gsl_matrix_view_array(vector, unknowns, unknowns);
    gsl_vector_view values = gsl_vector_view_array(value, unknowns);
    gsl_eigen_symmv_workspace *room = gsl_eigen_symmv_alloc(unknowns);
    gsl_eigen_symmv(&bends.matrix, &values.vector, &vectors.matrix, room);
    gsl_eigen_symmv_free(room);
    for (size_t k = 0; k < unknowns; k++) {
        most = fmax(most, fabs(value[k]));
    }
    memset(step, 0, unknowns * sizeof(double));
    for (size_t k = 0; k < unknowns; k++) {
        double along = 0.0;
        for (size_t i = 0; i < unknowns; i++) {
            along += vector[i * unknowns + k] * slope[i];
        }
        const double length = along / fmax(fabs(value[k]), 1e-12 * most);
        for (size_t i = 0; i < unknowns; i++) {
            step[i] += vector[i * unknowns + k] * length;
        }
    }
}

/* 0: of what is not searched, or leaves. */
static void newton_step(const evidence_work_t *work, const group_evidence_t *e, double *step) {
    double slope[MOST_UNKNOWNS], bend[MOST_UNKNOWNS][MOST_UNKNOWNS] = {{0.0}};
    double some[MOST_UNKNOWNS * MOST_UNKNOWNS], some_slope[MOST_UNKNOWNS], some_step[MOST_UNKNOWNS];
    size_t unknown[MOST_UNKNOWNS], unknowns = 0;
    between_t *between = allocate(1, sizeof *between);
    between_groups(work, e, between);
    derive(work, e, between, slope, bend);
    free(between);
    for (size_t g = 1; g <= e->groups; g++) {
        if (g < e->groups ? work->count[g] > 0 && !work->leaves[g] : work->find_variance) {
            unknown[unknowns++] = g;
        }
    }
    for (size_t i = 0; i < unknowns; i++) {
        some_slope[i] = slope[unknown[i]];
        for (size_t j = 0; j < unknowns; j++) {
            some[i * unknowns + j] = bend[unknown[i]][unknown[j]];
        }
    }
    memset(step, 0, MOST_UNKNOWNS * sizeof(double));
    if (unknowns > 0) {
        step_uphill(unknowns, some, some_slope, some_step);
    }
    for (size_t i = 0; i < unknowns; i++) {
        step[unknown[i]] = fmax(fmin(some_step[i], longest_step), -longest_step);
    }
}

void evidence_newton(const evidence_work_t *work, const group_evidence_t *e, evidence_place_t *next) {
    double step[MOST_UNKNOWNS];
    newton_step(work, e, step);
    evidence_here(e, next);
    next->variance = e->variance / exp(step[e->groups]);
    for (size_t g = 1; g < e->groups; g++) {
        if (!work->leaves[g]) {
            next->precision[g] = fmin(e->precision[g] * exp(step[g]), evidence_switched_off / next->variance);
        }
    }
}
