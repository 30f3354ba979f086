/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Smooth Everett functions: a Preisach plane of few numbers over a fine grid.
 *
 * A table of elements that are all free is either too coarse for small loops or has more elements than a recording
 * determines. The density of a real material is smooth; so is its Everett function over the relays' middle m and half
 * width r, but for r = 0, where it vanishes:
 *
 *     E(m + r, m - r) = r sum_ij c_ij B_i(m) C_j(sqrt r),     m from -1 to 1, r from 0 to 1 - |m|
 *
 * with quadratic B-splines B over the middle and C over the root of the half width, so that small widths, which small
 * loops are about, have as many functions as large ones. preisach_grid.h says what E is.
 */
#ifndef SMOOTH_PLANE_H
#define SMOOTH_PLANE_H

#include "chain/model.h"
#include "elements/preisach_grid.h"

/** Functions; some have no part in the triangle. */
size_t smooth_plane_functions(void);

/** Values of a function at all elements of a table; the middle of the outermost levels is m = 0. Returns the largest.
 */
double smooth_plane_function(const preisach_grid_t *grid, bool symmetric, size_t function, double *value);

/** Whether relays that mirror each other about the middle have the same density: then E(a, b) = E(-b, -a). */
bool smooth_plane_is_symmetric(size_t levels, const double *table);

/** Turns a block `preisach` into the smooth one that is nearest to its table, on a fine grid over this range. */
bool smooth_plane_from(model_block_t *preisach, const double drive_range_v[2], bool symmetric, failure_t *failure);

#endif
