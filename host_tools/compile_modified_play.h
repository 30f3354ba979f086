/* SPDX-License-Identifier: GPL-3.0-or-later */
/** The modified play model brought onto the amplifier's plane of plays. */
#ifndef COMPILE_MODIFIED_PLAY_H
#define COMPILE_MODIFIED_PLAY_H

#include "compile_job.h"

/** x[k] of recursion.h = offset_um + direct_um u + sum of cell_um times the cells of play_plane.h, u as there. */
typedef struct {
    double offset_um, direct_um;
    size_t divisions;
    const double *cell_um;        /**< play_plane_cells(divisions) */
    double fall_s, rise_s;        /**< alpha, beta */
    const parameter_t *recursion; /**< RECURSION_PARAMETERS of them */
} modified_play_numbers_t;

/**
 * The model's plane covers the range of its recording, the amplifier's has to cover the converter's: it gets more
 * divisions of the same width, the new ones empty, and a straight drive curve in front that matches the two scales. So
 * nothing is interpolated. Fails where that takes more divisions than the amplifier has.
 *
 * With harmonics, the image's phase is the one at which the source begins a sine: the model's drive leads the position
 * by as much as the model says at its own frequency.
 */
bool compile_modified_play(compile_job_t *job, const modified_play_numbers_t *numbers);

#endif
