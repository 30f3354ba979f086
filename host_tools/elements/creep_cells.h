/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Logarithmic creep as parallel first-order cells. Block creep, the fit and the amplifier's compensation all use it.
 *
 *     y = h + sum c_j s_j,   tau_j ds_j/dt = h - s_j,   tau_j = shortest ... longest, CREEP_CELLS_PER_DECADE to a
 * decade, c_j = gamma / CREEP_CELLS_PER_DECADE
 *
 * A step of h then grows by gamma per decade of time between shortest and longest (ripple below 3 % of gamma).
 */
#ifndef CREEP_CELLS_H
#define CREEP_CELLS_H

#include <stddef.h>

#define CREEP_CELLS_PER_DECADE 2
/** The number of cells in the amplifier. */
#define CREEP_MAX_CELLS 16

typedef struct {
    size_t cells;
    double gain;                  /**< c_j, the same for all */
    double rate[CREEP_MAX_CELLS]; /**< 1 - exp(-dt / tau_j): s_j[k] = s_j[k-1] + rate_j (h[k-1] - s_j[k-1]) */
} creep_cells_t;

/** 0 < shortest_s <= longest_s, at most 7.5 decades apart. */
creep_cells_t creep_cells(double gamma_per_decade, double shortest_s, double longest_s, double sample_rate_hz);

/** tau_j = shortest_s 10^(j / CREEP_CELLS_PER_DECADE). */
double creep_time_constant_s(double shortest_s, size_t cell);

/** y / h at rest: 1 + sum c_j. */
double creep_gain_at_rest(const creep_cells_t *cells);

/* One sample is creep_offset, then creep_follow. level has CREEP_MAX_CELLS elements. */

/** The levels s_j in the steady state at h. */
void creep_settle(const creep_cells_t *cells, double *level, double h);
/** sum c_j s_j: the contribution of creep at this sample, independent of this sample's h. */
double creep_offset(const creep_cells_t *cells, const double *level);
/** Advances the levels to the next sample. */
void creep_follow(const creep_cells_t *cells, double *level, double h);

#endif
