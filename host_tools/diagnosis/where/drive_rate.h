/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * At which rates of the drive an effect acts.
 *
 * Mean squares, as by drive level (locate.h), over logarithmic cells from the slowest motion of the drive, or a
 * ten-thousandth of the fastest, to the fastest. Holds (loop_part_t) are a separate cell, 0 to 0, but for
 * their first tenth of a second, which is that of the motion before: a limit of the rate shows behind a step, too. What
 * takes more than half of the cells has no place: then the range is all of them.
 */
#ifndef DRIVE_RATE_H
#define DRIVE_RATE_H

#include "diagnosis/where/location.h"

/** |rate| of the drive at every sample in V/s, since the sample before; 0 in holds, from a tenth of a second on. A
 * drive that goes in steps of its converter, or of its generator, moves by one step in the time that it stays there. */
void drive_rates(const double *drive, size_t samples, double sample_rate_hz, double *rate);

/** As locate.h has it of its arguments. */
void locate_in_rate(const recording_t *recordings, size_t count, double *const *difference, const size_t *from,
                    double floor_um, ranges_t *ranges);

#endif
