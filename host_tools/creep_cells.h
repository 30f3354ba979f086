/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Log-type creep as first-order cells in parallel: what block creep simulates, the fit searches and the amplifier
 * undoes.
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
/** As many as the amplifier has. */
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

/** The levels s_j after h has been present for ever. */
void creep_settle(const creep_cells_t *cells, double *level, double h);
/** sum c_j s_j: what creep adds to h at this sample. It does not depend on this sample's h. */
double creep_offset(const creep_cells_t *cells, const double *level);
/** Moves the levels to the next sample. */
void creep_follow(const creep_cells_t *cells, double *level, double h);

#endif
