/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Weights, and how well data determine them: what group_evidence.h finds. */
#ifndef OPERATOR_GROUP_WEIGHTS_H
#define OPERATOR_GROUP_WEIGHTS_H

#include <stddef.h>

/** A column of the last group is left out: its weight is 0. */
enum { EVIDENCE_MOST_GROUPS = 32, EVIDENCE_LEFT_OUT = EVIDENCE_MOST_GROUPS - 1 };

typedef struct {
    size_t columns, groups;
    double *weight;                          /**< the mean, columns */
    double *factor;                          /**< L, columns^2, lower: L L' = (X'X + variance * precisions) */
    double precision[EVIDENCE_MOST_GROUPS];  /**< of a group's weights */
    double determined[EVIDENCE_MOST_GROUPS]; /**< how many of its weights the data determine, rather than the prior */
    double variance;                         /**< of e */
    double log_evidence;
} group_evidence_t;

#endif
