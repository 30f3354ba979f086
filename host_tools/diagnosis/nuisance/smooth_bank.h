/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * A bank of many play operators whose weights lie on a smooth curve of few numbers:
 *
 *     w_i = (r_i+1/2 - r_i-1/2) sum_j c_j B_j(sqrt(r_i / r_n)),     B: quadratic B-splines
 *
 * A few dozen operators with free weights are a staircase that small loops feel; so many that none of it is left have
 * more weights than a recording determines. As for planes (smooth_plane.h), small thresholds have as many functions as
 * large ones.
 */
#ifndef SMOOTH_BANK_H
#define SMOOTH_BANK_H

#include "chain/model.h"

/** Banks with more operators than this change smoothly (hysteresis_numbers.h). */
enum { SMOOTH_BANK_OPERATORS = 64, SMOOTH_BANK_FUNCTIONS = 10 };

/** By how much a function changes each of the weights w_1.. w_n at these thresholds. */
void smooth_bank_function(const double *threshold_v, size_t operators, size_t function, double *change);

/** Turns a block `prandtl_ishlinskii` into the smooth bank whose initial curve is nearest to its own. */
bool smooth_bank_from(model_block_t *bank, failure_t *failure);

#endif
