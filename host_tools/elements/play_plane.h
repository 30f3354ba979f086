/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * The hysteresis of paper 001: a plane of plays divided into cells, with N divisions (docs/MODELS.md, section 9).
 *
 *     r_i = i / N,  i = 1 .. N - 1
 *     p_i[k] = max(u[k] - alpha |v| - r_i, min(u[k] + beta |v| + r_i, p_i[k-1])),    v = (u[k-1] - u[k-2]) / dt
 *     cell (i, j), j = 0 .. N - 1 - i:    clamp((p_i - center) / half width, -1, 1)
 *
 * The N - i cells of row i share [-(1 - r_i), 1 - r_i] evenly. u is the drive as a fraction of its half range. Row 0 is
 * the drive itself and not part of the plane.
 */
#ifndef PLAY_PLANE_H
#define PLAY_PLANE_H

#include <stddef.h>

/** Most divisions. */
#define PLAY_PLANE_MAX 32

typedef struct {
    size_t divisions;
    double fall, rise;           /**< alpha, beta in samples */
    double input, rate;          /**< of the last sample; change in it */
    double play[PLAY_PLANE_MAX]; /**< [i - 1] belongs to row i */
} play_plane_t;

/** Number of cells: N (N - 1) / 2. */
static inline size_t play_plane_cells(size_t divisions) {
    return divisions * (divisions - 1) / 2;
}

/** Divisions of a plane with this number of cells; 0 if there is none up to PLAY_PLANE_MAX. */
size_t play_plane_divisions(size_t cells);

/** alpha_s, beta_s >= 0. Demagnetised. */
void play_plane_open(play_plane_t *plane, size_t divisions, double alpha_s, double beta_s, double sample_rate_hz);

/** Demagnetises, then moves slowly to u and rests there. cell has play_plane_cells elements. */
void play_plane_settle(play_plane_t *plane, double u, double *cell);
/** One sample. */
void play_plane_step(play_plane_t *plane, double u, double *cell);

#endif
