/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Noise at rest beside what is called noise altogether.
 *
 * What the universal operator cannot follow is not noise, but looks like it: its variance or its share of 1/f comes out
 * too large. While the drive rests nothing of that acts, and the same noise has to be there.
 */
#ifndef BELIEF_REST_H
#define BELIEF_REST_H

#include "belief/fitted_chain.h"

/** Whether the samples at rest speak, by evidence_margin, for less noise than the fit has: for less than its variance
 * over most_moving_over_resting or, of the operator alone, for less 1/f. The difference has to be more than
 * worth_mentioning of the noise there, and floor_um. false where the drive rests for too few samples to tell. step_um:
 * of the position converter, whose error is there at rest, too; 0: none to be seen. */
bool rest_is_quieter(const fitted_chain_t *fitted, double step_um, double floor_um);

#endif
