/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Transfers the modified play model to the amplifier's plane of plays. */
#ifndef COMPILE_MODIFIED_PLAY_H
#define COMPILE_MODIFIED_PLAY_H

#include "compile/compile_job.h"

/** x[k] of recursion.h = offset_um + direct_um u + sum of cell_um times the cells of play_plane.h, u as there. */
typedef struct {
    double offset_um, direct_um;
    size_t divisions;
    const double *cell_um;        /**< play_plane_cells(divisions) */
    double fall_s, rise_s;        /**< alpha, beta */
    const parameter_t *recursion; /**< RECURSION_PARAMETERS of them */
} modified_play_numbers_t;

/**
 * The model's plane covers the range of its recording, and the amplifier's must cover the range of the converter. So it
 * gets more divisions of the same width, of which the new ones are empty, and a straight drive curve in front that
 * converts the scale. No value is interpolated. Fails if that takes more divisions than the amplifier has.
 *
 * With harmonics, the phase in the image is that at which the reference source begins a sine: the drive leads the
 * position by the model's phase at that frequency.
 */
bool compile_modified_play(compile_job_t *job, const modified_play_numbers_t *numbers);

#endif
