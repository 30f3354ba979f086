/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Fits the numbers of a chain's hysteresis again, with everything else in the chain as it is. */
#ifndef HYSTERESIS_REFIT_H
#define HYSTERESIS_REFIT_H

#include "chain.h"

/**
 * One Gauss-Newton step over all numbers of the hysteresis that are not chosen, from simulations that differ in one
 * number: exact where the chain is linear in them (offset and weights of a play bank, a Preisach table). Uses the
 * samples that are not held out (evidence.h) and whose memory is determined. Play weights that are not negative stay
 * so.
 */
bool hysteresis_refit(model_t *model, const recording_t *recordings, size_t count, failure_t *failure);

#endif
