/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * A better place on another hill: the whole range of one group's precision, the other groups as they are.
 *
 * Whether a group is of use may depend on where its precision is: the evidence along it can have two tops, one of them
 * at infinity, out of use. The steps of evidence_step.h end on the nearer one. But along one precision the evidence has
 * a closed form. The group's weights are N(w, S) by data and prior together; without the prior of precision a the data
 * say P = S^-1 - a I and h = S^-1 w of them. With P = U diag(l) U' and z = U'h, the log evidence at a precision a is,
 * but for a constant,
 *
 *     1/2 sum_i [ log(a / (l_i + a)) + z_i^2 / (l_i + a) ]
 */
#ifndef OPERATOR_EVIDENCE_RANGE_H
#define OPERATOR_EVIDENCE_RANGE_H

#include "operator/evidence_step.h"

/**
 * The place with that precision changed which is worth most, after evidence_fixed_point at this one. Returns what it is
 * worth, in natural units: to a factor of sqrt(2) in the precision the best of its group.
 */
double evidence_elsewhere(const evidence_work_t *work, const group_evidence_t *evidence, evidence_place_t *next);

#endif
