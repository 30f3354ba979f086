/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "belief/kept_chains.h"

fitted_chain_t *kept_chain(kept_chains_t *kept, const samples_t *samples, const model_t *chain) {
    for (size_t i = 0; i < KEPT_CHAINS; i++) {
        if (fitted_chain_is_of(&kept->chain[i], samples, chain)) {
            return &kept->chain[i];
        }
    }
    fitted_chain_t *oldest = &kept->chain[kept->made++ % KEPT_CHAINS];
    model_t operated;
    fitted_chain_close(oldest);
    chain_for_operator(chain, &operated);
    const bool good = fitted_chain_open(oldest, samples, &operated, NULL);
    model_free(&operated);
    return good ? oldest : NULL;
}

void kept_chains_close(kept_chains_t *kept) {
    for (size_t i = 0; i < KEPT_CHAINS; i++) {
        fitted_chain_close(&kept->chain[i]);
    }
    kept->made = 0;
}
