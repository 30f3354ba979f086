/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Suspects of a scan with their numbers, the operator's weights and the noise fitted together.
 *
 * A scan keeps the weights of the fit without the block. These have taken up what they could of it, and so has the
 * noise: a strong block cannot be found from there, and a slow one is worth too little. Here weights and noise are
 * fitted with the block in the chain, its numbers move, and so on in turns.
 */
#ifndef BELIEF_SUSPECT_FIT_H
#define BELIEF_SUSPECT_FIT_H

#include "belief/fitted_chain.h"

/** Fits all of these, from the numbers that they have on; the best comes first. fitted: the chain without them. turns:
 * at most so many fits of each. `gain`: by how much the evidence is more than without the block, in natural units; it
 * may be less than 0. */
void suspects_fit(fitted_chain_t *fitted, const probe_setting_t *setting, int turns, suspects_t *suspects);

/**
 * What a linear scan says, and a fit of each block that a look has shown (probe_t.from_look) and that has another form
 * with other numbers, but does not ring. The operator imitates a rail as far as its columns go: beside its weights
 * nothing speaks for one, or one somewhere else does. It is done once: who comes again gets it, whatever the setting.
 */
const suspects_t *fitted_chain_suspects(fitted_chain_t *fitted, const probe_setting_t *setting);

/**
 * The few of the scan beside this chain that promise most, with the numbers at which the evidence is largest:
 * suspect_fit. It is done once: who asks again gets it, whatever the setting.
 */
const suspects_t *fitted_suspects(fitted_chain_t *fitted, const probe_setting_t *setting);

#endif
