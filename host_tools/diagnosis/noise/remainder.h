/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Whether what a model leaves is more than noise, without a name for it.
 *
 * The whitened residual of a complete model is flat over frequency. Where a band of frequencies (half an octave) holds
 * more than the noise at rest accounts for, something is left: a drift in the lowest, a mode or a wandering tone in one
 * of them, jumps and jitter in all. Single samples far outside the noise count too; so does what goes with the position
 * (by_level.h), and what the samples of either part, fitted or held out, hold altogether.
 */
#ifndef REMAINDER_H
#define REMAINDER_H

#include "diagnosis/noise/by_level.h"
#include "diagnosis/noise/noise.h"

typedef struct {
    double rms_um;          /**< of what is left beside the noise, all bands that hold more than noise together */
    double low_hz, high_hz; /**< the band that holds most of it; 0, 0: none */
    size_t outliers;        /**< samples of the whitened residual beyond 7 deviations */
    by_level_t by_level;    /**< what goes with the position */
    bool at_levels;         /**< that is more than the simulation may be off by */
    bool structured;        /**< by any of them */
} remainder_t;

/** What a rich model leaves is taken for noise where the drive never rests; false where that is more than a sensor's.
 */
bool remainder_knows_noise(const samples_t *samples, const noise_t *noise);

/**
 * simulated, effect: columns of the model's simulation (past_simulate), and of its difference from the one without what
 * was found, of which a few percent may be the simulation's error. floor_um: root mean square of what counts as noise
 * besides (steps of the converter).
 */
remainder_t remainder_of(const samples_t *samples, const noise_t *noise, const double *simulated, const double *effect,
                         double floor_um);

#endif
