/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Which blocks could stand in the place of a finding, whatever shape the hysteresis has.
 *
 * Beside one shape of hysteresis two lags may differ clearly, because that shape is a little wrong. Beside the
 * universal operator they often do not: then the recordings do not say which of them it is.
 */
#ifndef RIVALS_H
#define RIVALS_H

#include "belief/fitted_chain.h"

enum { RIVALS_MOST = 4 };

typedef struct {
    double gain;      /**< natural units of evidence that the block itself is worth; 0: it does not show */
    double best_gain; /**< of the others, the largest */
    size_t count;
    const block_t *rival[RIVALS_MOST]; /**< the best first */
} rivals_t;

/**
 * fitted: the chain without the block. strong: with its numbers, if it leaves little of what was there; NULL: it does
 * not. The weights of the fit without it have then taken up what they could of it. So a rival may be worth as much by
 * its best probe alone, and those of other groups are fitted together with new weights, as it is. A block that is worth
 * no more than evidence_margin has none: the operator says nothing of it.
 */
void rivals_of(fitted_chain_t *fitted, const probe_setting_t *setting, const block_t *block,
               const model_block_t *strong, rivals_t *rivals);

/** Which other blocks with the same numbers, at another place of the chain, are worth as much, each fitted together
 * with the weights. Where a block of more numbers was found: a scan knows the others only. fitted: the chain without
 * it. */
void rivals_elsewhere(fitted_chain_t *fitted, const probe_setting_t *setting, const model_block_t *found,
                      rivals_t *rivals);

#endif
