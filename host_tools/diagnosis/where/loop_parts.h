/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Turning points, mid branch and holds of a drive. */
#ifndef LOOP_PARTS_H
#define LOOP_PARTS_H

#include "diagnosis/where/location.h"

/** A drive that stays within this part of its range is held: a step of 16 bits. */
extern const double loop_still;

/** part[k] of every sample: LOOP_EVERYWHERE of none. */
void loop_parts(const double *drive, size_t samples, loop_part_t *part);

/** The part of the loop where a difference is largest, as location.h says. */
loop_part_t find_loop_part(const recording_t *recordings, size_t count, double *const *difference, const size_t *from,
                           double floor_um);

#endif
