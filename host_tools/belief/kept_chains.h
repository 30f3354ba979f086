/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Chains that were fitted beside the operator, kept for who asks for the same again. */
#ifndef KEPT_CHAINS_H
#define KEPT_CHAINS_H

#include "belief/fitted_chain.h"

/** As many as a review asks for in turn: the answer's, and without each of three findings. */
enum { KEPT_CHAINS = 4 };

/** {0}: none. */
typedef struct {
    size_t made; /**< so far; the newest ones are there */
    fitted_chain_t chain[KEPT_CHAINS];
} kept_chains_t;

/** The fit of this chain, whatever its hysteresis, to these samples: one that is kept, or a new one in the place of the
 * oldest. NULL where fitted_chain_open fails. */
fitted_chain_t *kept_chain(kept_chains_t *kept, const samples_t *samples, const model_t *chain);
/** Fits those that are not kept side by side, each in the place of the oldest that is not among them. At most
 * KEPT_CHAINS, each another one. */
void kept_chains_prepare(kept_chains_t *kept, const samples_t *samples, const model_t *const *chain, size_t count);
void kept_chains_close(kept_chains_t *kept);

#endif
