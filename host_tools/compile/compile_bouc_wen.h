/* SPDX-License-Identifier: GPL-3.0-or-later */
/** The Bouc-Wen curve cut into straight cells, as the amplifier runs it (lib/hyst, bouc_wen.h). */
#ifndef COMPILE_BOUC_WEN_H
#define COMPILE_BOUC_WEN_H

#include "compile/compile_job.h"
#include "elements/bouc_wen.h"

/**
 * The curve of h on a rising branch, from -E to E: cell i is length[i] of drive long, and h rises by rise[i] in it. E
 * is what a drive that travels by `reach` reaches from h = 0, but at most as near to the limit as the cells resolve.
 * Cells are shorter where the curvature is larger, so that all chords have the same error. Returns that error.
 */
double bouc_wen_cells(const bouc_wen_t *model, double reach, size_t cells, double *length, double *rise);

/**
 * The hysteresis is offset_um + direct_um u + hysteretic_um h of the model, u the drive's distance from center_v in
 * units of half_range_v. report->merge_error_um is the largest distance of cells and branch.
 */
bool compile_bouc_wen(compile_job_t *job, const bouc_wen_t *model, double offset_um, double direct_um,
                      double hysteretic_um, double center_v, double half_range_v);

#endif
