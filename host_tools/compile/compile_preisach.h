/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Transfers a Preisach table to the amplifier's grid, whose levels divide the drive converter's range evenly. */
#ifndef COMPILE_PREISACH_H
#define COMPILE_PREISACH_H

#include "compile/compile_job.h"
#include "elements/preisach_grid.h"

/**
 * Chooses the number of intervals with the least change of the branches within the amplifier's drive limits;
 * report->merge_error_um is that change. Inside the model's levels the amplifier's table is that of the model at the
 * same pairs of drives. Outside of them it continues the last interval linearly. The part of that interval inside the
 * model's levels is then exact, and no other part is used.
 */
bool compile_preisach(compile_job_t *job, const preisach_grid_t *model, const double *everett_um, double offset_um);

#endif
