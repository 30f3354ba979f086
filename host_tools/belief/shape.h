/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Is what a model leaves only another shape of the hysteresis?
 *
 * The universal operator (operator/columns.h) takes the place of a chain's hysteresis. What separates hysteresis from
 * everything else is that its output depends on the path of the drive and not on how fast or when it was travelled.
 * What the operator explains, on held-out samples, is therefore the shape of the loops, and what it leaves is not.
 */
#ifndef BELIEF_SHAPE_H
#define BELIEF_SHAPE_H

#include "belief/fitted_chain.h"

typedef struct {
    bool fitted;                  /**< false: the drive does not move, or the chain cannot be simulated; all else 0 */
    double operator_percent;      /**< NRMSE of the held-out samples that are determined */
    double left_um;               /**< their rms error, of all recordings together */
    double noise_percent, rho_hz; /**< of the noise beside the operator: its white part; where 1/f is as strong */
    double not_determined;        /**< part of the held-out samples: where the fitted ones say too little */
    double deviations;            /**< rms of what is left of the others, whitened, over what it should be */
    bool turns, law;              /**< the drive turns between samples; a Duhem law was worth its numbers */
    size_t outliers;              /**< samples pulled in to the edge of the noise */
    double log_evidence;          /**< of the position, natural units; to compare chains on the same samples */
    bool whole;                   /**< nothing is left but noise: what else a model leaves is its hysteresis' shape */
    const block_t *loudest;       /**< shape_scan: the block that is worth most beside it; NULL: was not asked */
    double gain;                  /**< natural units that this block is worth */
    bool silent;                  /**< no block is worth enough */
    bool bends;                   /**< but for curves, none is worth least_gain: a hysteresis bends, too */
} shape_t;

/** The operator in the place of the hysteresis in a chain, fitted to all samples that are not held out. step_um: of the
 * position converter, 0: none to be seen. */
void shape_of(fitted_chain_t *fitted, double step_um, shape_t *shape);
/** Whether held-out samples leave not far more than a noise that was found otherwise, rms. The operator's own noise is
 * as strong in slow changes as it takes, and may be a drift. */
bool shape_within_noise(const shape_t *shape, const samples_t *samples, double step_um, double noise_um);
/** Adds what every block of the catalogue that the chain does not have is worth beside it. */
void shape_scan(fitted_chain_t *fitted, const probe_setting_t *setting, shape_t *shape);

#endif
