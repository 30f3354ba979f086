/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "operator/evidence_range.h"
#include "base/failure.h"
#include <gsl/gsl_blas.h>
#include <gsl/gsl_eigen.h>
#include <gsl/gsl_linalg.h>
#include <gsl/gsl_math.h>
#include <math.h>
#include <stdlib.h>

/* Precisions from a hundred times what the data say of the best known weight (there they determine a hundredth of it:
 * the group is out of use), in factors of two, from which Newton's steps go on, over 16 decades. */
enum { PLACES = 54 };
static const double out_of_use = 100.0, apart = 2.0;

/* What the data say of a group without its prior. */
typedef struct {
    gsl_vector *known; /* l, of each direction */
    gsl_vector *pull;  /* z */
} group_alone_t;

/* S and w of a group; `column` has those of its m. */
static void take_group(const evidence_work_t *work, const group_evidence_t *e, const size_t *column, gsl_matrix *s,
                       gsl_vector *weight) {
    for (size_t i = 0; i < weight->size; i++) {
        gsl_vector_set(weight, i, e->weight[column[i]]);
        for (size_t j = 0; j <= i; j++) {
            const double covariance = e->variance * work->covariance[column[i] * e->columns + column[j]];
            gsl_matrix_set(s, i, j, covariance);
            gsl_matrix_set(s, j, i, covariance);
        }
    }
}

/* False where its covariance has no inverse. To be freed. */
static bool take_alone(const evidence_work_t *work, const group_evidence_t *e, size_t group, const size_t *column,
                       size_t m, group_alone_t *alone) {
    gsl_matrix *s = gsl_matrix_alloc(m, m), *direction = gsl_matrix_alloc(m, m);
    gsl_vector *h = gsl_vector_alloc(m);
    gsl_eigen_symmv_workspace *room = gsl_eigen_symmv_alloc(m);
    *alone = (group_alone_t){gsl_vector_alloc(m), gsl_vector_alloc(m)};
    take_group(work, e, column, s, alone->pull);
    const bool good = gsl_linalg_cholesky_decomp1(s) == 0;
    if (good) {
        gsl_linalg_cholesky_invert(s);
        gsl_blas_dgemv(CblasNoTrans, 1.0, s, alone->pull, 0.0, h);
        gsl_vector_view diagonal = gsl_matrix_diagonal(s);
        gsl_vector_add_constant(&diagonal.vector, -e->precision[group]);
        gsl_eigen_symmv(s, alone->known, direction, room);
        gsl_blas_dgemv(CblasTrans, 1.0, direction, h, 0.0, alone->pull);
    }
    for (size_t i = 0; i < m; i++) { /* of what the prior alone says, round-off is left */
        gsl_vector_set(alone->known, i, fmax(gsl_vector_get(alone->known, i), 0.0));
    }
    gsl_matrix_free(s);
    gsl_matrix_free(direction);
    gsl_vector_free(h);
    gsl_eigen_symmv_free(room);
    return good;
}

static void free_alone(group_alone_t *alone) {
    gsl_vector_free(alone->known);
    gsl_vector_free(alone->pull);
}

static double evidence_at(const group_alone_t *alone, double precision) {
    double sum = 0.0;
    for (size_t i = 0; i < alone->known->size; i++) {
        const double all = gsl_vector_get(alone->known, i) + precision;
        sum += log(precision / all) + gsl_pow_2(gsl_vector_get(alone->pull, i)) / all;
    }
    return 0.5 * sum;
}

/* What the best precision of a group is worth beside the one that it has. */
static double best_precision(const group_alone_t *alone, double now, double *best) {
    double precision = out_of_use * gsl_vector_max(alone->known), most = 0.0;
    const double here = evidence_at(alone, now);
    for (size_t i = 0; precision > 0.0 && i < PLACES; i++) {
        const double gain = evidence_at(alone, precision) - here;
        if (gain > most) {
            most = gain;
            *best = precision;
        }
        precision /= apart;
    }
    return most;
}

double evidence_elsewhere(const evidence_work_t *work, const group_evidence_t *e, evidence_place_t *next) {
    size_t *column = allocate(e->columns, sizeof *column);
    size_t best = 0;
    double most = 0.0, best_of_it = 0.0;
    evidence_covariance(work, e);
    for (size_t g = 1; g < e->groups; g++) {
        size_t m = 0;
        double precision = 0.0;
        group_alone_t alone;
        for (size_t j = 0; j < e->columns; j++) {
            column[m] = j;
            m += work->group[j] == g ? 1 : 0;
        }
        if (m == 0) {
            continue;
        }
        const double gain =
            take_alone(work, e, g, column, m, &alone) ? best_precision(&alone, e->precision[g], &precision) : 0.0;
        free_alone(&alone);
        if (gain > most) {
            most = gain;
            best = g;
            best_of_it = precision;
        }
    }
    evidence_here(e, next);
    next->precision[best] = most > 0.0 ? best_of_it : e->precision[best];
    free(column);
    return most;
}
