/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Instants at which something about the readings changed for good: samples that were lost or read twice, a gain or an
 * offset that was switched.
 *
 * Against the columns of the reference (look/path/reference.h) each instant on a grid of windows is tried: that the
 * readings from there on are shifted (look/path/shifts.h), or have another gain and offset (look/path/switches.h). The
 * fit of the columns is exact in each trial: its normal equations only need sums up to and from the instant
 * (look/path/changes_problem.h). The best instant is refined to the sample, the readings are set right, and the search
 * goes on. Two clocks (look/path/clocks.h) that leave less than the shifts take their place.
 *
 * The likelihood ratio is N / tau log(RSS without / RSS with), tau the autocorrelation time of what is left. A change
 * counts if that says so and if the readings jump there (look/path/jump.h), or cannot tell, and little but noise is
 * left.
 *
 * Because what the reference cannot follow is no noise, changes have to explain 40 % of all that the reference leaves,
 * too; gain and offset have to do so beside a gain and an offset that drift. Small changes stay unseen for that.
 */
#ifndef LOOK_CHANGES_FIND_H
#define LOOK_CHANGES_FIND_H

#include "look/path/changes.h"
#include "look/path/prediction.h"
#include "look/path/wrong.h"

void changes_find(const recording_t *recording, const drive_look_t *drive, const reference_t *reference,
                  const prediction_t *prediction, double noise_um, const wrong_t *wrong, double log_chance_limit,
                  changes_t *changes);

#endif
