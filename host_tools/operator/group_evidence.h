/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Weights by evidence: a linear model with Gaussian priors of which each group of columns shares one variance.
 *
 *     y = X w + e,   w_j ~ N(0, 1 / precision of its group),   e ~ N(0, variance)
 *
 * The precisions and the variance are those under which the data are likeliest when the weights are integrated out
 * (MacKay, Neural Computation 4, 1992). They are found by his fixed point and Newton's steps (evidence_step.h), and
 * where these end, on another hill if one is higher (evidence_range.h), from X'X and X'y alone. So hundreds of columns
 * cost nothing where a few of them are enough, and the same factor says how well a prediction is determined.
 */
#ifndef OPERATOR_GROUP_EVIDENCE_H
#define OPERATOR_GROUP_EVIDENCE_H

#include "numerics/least_squares.h"
#include "operator/group_weights.h"

/**
 * group[j] < groups for each column, or EVIDENCE_LEFT_OUT; group 0 is free: it has no prior. variance: that of e, or 0
 * where it is to be found as well. start: a fit of nearly the same equations, from which it is not far; NULL: none. On
 * success to be freed. Fails where the equations have no rows.
 */
bool group_evidence_fit(const normal_equations_t *equations, const size_t *group, size_t groups, double variance,
                        const group_evidence_t *start, group_evidence_t *evidence, failure_t *failure);
/** A fit that starts with this one begins anew with the groups that it has out of use: several of them together may be
 * worth something that no single one is. */
void group_evidence_forget_unused(group_evidence_t *evidence);
void group_evidence_free(group_evidence_t *evidence);

/**
 * Variance of the predictions X w of `rows` rows that stand one after the other, by what the data leave open of the
 * weights, in parts of evidence->variance. The rows are changed.
 */
void group_evidence_open(const group_evidence_t *evidence, double *row, size_t rows, double *part);

#endif
