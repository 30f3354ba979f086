/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "belief/kept_chains.h"
#include "base/oldest_place.h"
#include "base/parallel.h"

/* Its index; KEPT_CHAINS: it is not kept. */
static size_t find_chain(const kept_chains_t *kept, const samples_t *samples, const model_t *chain) {
    size_t i = 0;
    while (i < KEPT_CHAINS && !fitted_chain_is_of(&kept->chain[i], samples, chain)) {
        i++;
    }
    return i;
}

/* Fits that are made at once: each task writes its own. */
typedef struct {
    const samples_t *samples;
    const model_t *chain[KEPT_CHAINS];
    fitted_chain_t *fitted[KEPT_CHAINS];
} fits_t;

static void fit_chain(void *context, size_t index) {
    const fits_t *fits = context;
    model_t operated;
    chain_for_operator(fits->chain[index], &operated);
    (void)fitted_chain_open(fits->fitted[index], fits->samples, &operated, NULL);
    model_free(&operated);
}

void kept_chains_prepare(kept_chains_t *kept, const samples_t *samples, const model_t *const *chain, size_t count) {
    bool wanted[KEPT_CHAINS + 1] = {false};
    fits_t fits = {.samples = samples};
    size_t made = 0;
    for (size_t i = 0; i < count; i++) {
        wanted[find_chain(kept, samples, chain[i])] = true;
    }
    for (size_t i = 0; i < count; i++) {
        if (find_chain(kept, samples, chain[i]) == KEPT_CHAINS) {
            const size_t oldest = oldest_place(&kept->made, KEPT_CHAINS, wanted);
            fitted_chain_close(&kept->chain[oldest]);
            fits.chain[made] = chain[i];
            fits.fitted[made++] = &kept->chain[oldest];
        }
    }
    parallel(made, fit_chain, &fits);
}

fitted_chain_t *kept_chain(kept_chains_t *kept, const samples_t *samples, const model_t *chain) {
    kept_chains_prepare(kept, samples, &chain, 1);
    const size_t there = find_chain(kept, samples, chain);
    return there < KEPT_CHAINS ? &kept->chain[there] : NULL;
}

void kept_chains_close(kept_chains_t *kept) {
    for (size_t i = 0; i < KEPT_CHAINS; i++) {
        fitted_chain_close(&kept->chain[i]);
    }
    kept->made = 0;
}
