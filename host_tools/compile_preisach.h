/* SPDX-License-Identifier: GPL-3.0-or-later */
/** A Preisach table brought onto the amplifier's grid, whose levels divide the drive converter's range evenly. */
#ifndef COMPILE_PREISACH_H
#define COMPILE_PREISACH_H

#include "compile_job.h"
#include "preisach_grid.h"

/**
 * Takes the number of intervals that changes the branches between drives within the amplifier's limits least;
 * report->merge_error_um is that change. Inside the model's levels the amplifier's table is the model's at the same
 * pairs of drives. An amplifier's level outside of them gets what continues the last piece inside straight on: so the
 * piece itself is met exactly, and nothing else of that interval is ever used.
 */
bool compile_preisach(compile_job_t *job, const preisach_grid_t *model, const double *everett_um, double offset_um);

#endif
