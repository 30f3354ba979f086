/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Instants at which something about the readings changed for good: samples that were lost or read twice, a gain or an
 * offset that was switched.
 *
 * Against the columns of the reference (look/path/reference.h) each instant on a grid of windows is tried: that the
 * readings from there on are shifted by D = +-1 .. +-12 samples, or have another gain and offset. The fit of the
 * columns is exact in each trial: its normal equations only need sums up to and from the instant. The best instant is
 * refined to the sample, the readings are set right, and the search goes on.
 *
 * The likelihood ratio is N / tau log(RSS without / RSS with), tau the autocorrelation time of what is left. Shifts are
 * added as long as it says so. Only then each of them is judged, with all others set right: by the ratio, and by
 * whether the readings jump there (or cannot tell, and little but noise is left). Two clocks (look/path/clocks.h) that
 * leave less than the shifts take their place.
 *
 * Because what the reference cannot follow is no noise, changes have to explain 40 % of all that the reference leaves,
 * too; gain and offset have to do so beside a gain and an offset that drift. Small changes stay unseen for that. A
 * switched gain acts on the path that the columns make with the switch beside them; it is an offset alone where that
 * does as well.
 */
#ifndef LOOK_CHANGES_H
#define LOOK_CHANGES_H

#include "look/path/lags.h"
#include "look/path/wrong.h"

enum { CHANGES_MOST = 8, CHANGES_MOST_SHIFT = 12 };

typedef struct {
    size_t at;     /**< first reading behind it */
    size_t within; /**< samples to either side in which it may be */
    int samples;   /**< lost: positive; read twice: negative */
    double log_chance;
} shift_t;

typedef struct {
    size_t at, within;
    /** reading = gain times what it would have been + offset; sigma of the gain 0: the offset alone does as well */
    double gain, gain_sigma, offset_um, offset_sigma_um;
    double log_chance;
} switch_t;

typedef struct {
    size_t shifts, switches;
    shift_t shift[CHANGES_MOST];
    switch_t change[CHANGES_MOST];
    lag_course_t clocks;       /**< size 0: none (look/path/clocks.h) */
    double before_um, left_um; /**< what the reference leaves, before and after these */
} changes_t;

void changes_find(const recording_t *recording, const drive_look_t *drive, const reference_t *reference,
                  const prediction_t *prediction, double noise_um, const wrong_t *wrong, double log_chance_limit,
                  changes_t *changes);

#endif
