/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Where the search for the likeliest precisions goes from a place: the steps of group_evidence_fit.
 *
 * MacKay's fixed point finds its way from anywhere, and then needs a hundred rounds, as groups of columns that can
 * stand for each other move along a ridge. Newton's step, with the second derivatives of the evidence by the logarithms
 * of the precisions and of the variance, is at the top of the same hill in a few; far from it it goes anywhere.
 */
#ifndef OPERATOR_EVIDENCE_STEP_H
#define OPERATOR_EVIDENCE_STEP_H

#include "numerics/least_squares.h"
#include "operator/group_weights.h"

/** A group that the data do not need is switched off at this precision, in parts of 1 / variance. */
static const double evidence_switched_off = 1e12;

typedef struct {
    double precision[EVIDENCE_MOST_GROUPS];
    double variance;
} evidence_place_t;

/** A fit at a place, and what its steps need of it. The pointers are the caller's. */
typedef struct {
    const normal_equations_t *equations;
    const size_t *group;
    size_t count[EVIDENCE_MOST_GROUPS]; /**< columns of a group */
    bool find_variance;
    double misfit;                       /**< of the weights */
    double *inverse;                     /**< columns^2: L^-1, of evidence_fixed_point */
    double *covariance;                  /**< columns^2, lower: (L L')^-1, of evidence_covariance */
    double *diagonal;                    /**< columns: of (L L')^-1, the same */
    double open[EVIDENCE_MOST_GROUPS];   /**< sums over a group's columns: the variances of their weights, the same */
    double square[EVIDENCE_MOST_GROUPS]; /**< the squares of their weights, the same */
    bool leaves[EVIDENCE_MOST_GROUPS];   /**< groups that are out of use and would go farther out, the same */
} evidence_work_t;

/** The place that a fit is at. */
void evidence_here(const group_evidence_t *evidence, evidence_place_t *here);
/** Needs `inverse`. */
void evidence_covariance(const evidence_work_t *work, const group_evidence_t *evidence);

/**
 * The fixed point's next place, with evidence->determined. Returns the largest change of a precision on the way, as a
 * logarithm. A group that leaves stays where it is, at the edge of use: from there it can come back.
 */
double evidence_fixed_point(evidence_work_t *work, group_evidence_t *evidence, evidence_place_t *next);

/** Newton's next place, after evidence_fixed_point at the same. */
void evidence_newton(const evidence_work_t *work, const group_evidence_t *evidence, evidence_place_t *next);

#endif
