/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * The branch of a bank of play operators after a reversal, as a function of threshold, and the reduction of the bank to
 * fewer operators.
 *
 * After a reversal, a drive change of 2 r changes the output by 2 F(r), F(r) = w_0 r + sum_{a_i < r} w_i (r - a_i). F
 * determines the bank, so a bank is reduced by removing corners from F.
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
 * Merges operators: those at or beyond `range` are dropped (they never move within a drive range of 2 range). Then it
 * removes the corner whose removal changes F least, while there are more than `most` operators, or the change is at
 * most `tolerance`, or the spacing is below `spacing`. Works in place. Returns the largest change of 2 F over 0 to
 * range.
 */
double play_bank_thin(play_bank_t *bank, size_t most, double range, double tolerance, double spacing);

#endif
