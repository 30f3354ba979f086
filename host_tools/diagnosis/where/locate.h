/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Where an effect acts: at which times, frequencies, drive levels and drive rates, and in which part of the loop.
 *
 * It is read from a difference of two simulations, with and without the effect, or from what remains of a measured
 * displacement. Ranges are the fewest that hold 80 % of it: of its energy, for time and frequency; of its
 * mean square at each level, for the drive and its rate (drive_rate.h), because a drive does not stay equally long
 * everywhere. What takes more than half of the time, of the drive's range or of its rates has no place there: then the
 * range is all of it.
 */
#ifndef LOCATE_H
#define LOCATE_H

#include "diagnosis/where/location.h"

/**
 * difference[i][k] is in um, k from from[i] to the end of recording i. Of a residual, floor_um is the deviation of the
 * noise in it, and the part that white noise of this deviation would have is taken out first; 0 for simulations.
 */
void locate(const recording_t *recordings, size_t count, double *const *difference, const size_t *from, double floor_um,
            location_t *location);

#endif
