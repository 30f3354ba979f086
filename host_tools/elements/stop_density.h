/* SPDX-License-Identifier: GPL-3.0-or-later */
/** The play bank to which block stop_density is equivalent (docs/MODELS.md, section 12). */
#ifndef STOP_DENSITY_H
#define STOP_DENSITY_H

#include <stddef.h>

/** p(r) = alpha exp(-beta (r - delta)^2) at thresholds r_j = a v_j + b over rising drive levels v_j > v_0 = 0. */
typedef struct {
    double alpha_um_per_v2, beta_per_v2, delta_v;
    double a, b_v;
    size_t levels;
    const double *level_v; /**< v_1 .. v_levels */
} stop_density_t;

/** Thresholds r_j and weights p(r_j) (r_j - r_j-1) of the plays, `levels` each. Returns the sum of the weights, by
 * which the direct weight of the drive is below the gain. */
double stop_density_bank(const stop_density_t *density, double *threshold_v, double *weight);

#endif
