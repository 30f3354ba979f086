/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * The branch that a bank of play operators draws after a turning point, as a function of threshold, and its reduction
 * to fewer operators.
 *
 * Half a branch: after a turning point a drive change of 2 r changes the output by 2 F(r), F(r) = w_0 r + sum_{a_i < r}
 * w_i (r - a_i). F determines the bank, so a bank is thinned by taking corners out of F.
 */
#ifndef PLAY_CURVE_H
#define PLAY_CURVE_H

#include <stddef.h>

typedef struct {
    size_t operators;
    double *weight;    /**< operators + 1 */
    double *threshold; /**< operators, rising */
} play_bank_t;

/**
 * Merges operators: those at or beyond `range` are dropped (they never move inside a drive range of twice that), then
 * the corner whose loss changes F least goes, as long as there are more than `most` operators or the loss is at most
 * `tolerance`, or the spacing is below `spacing`. Works in place. Returns the largest change of 2 F over 0 to range.
 */
double play_bank_thin(play_bank_t *bank, size_t most, double range, double tolerance, double spacing);

#endif
