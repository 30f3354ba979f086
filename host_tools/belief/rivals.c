/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "belief/rivals.h"
#include "thresholds/thresholds.h"
#include <math.h>

/* By how much less evidence another block may have. */
static double margin_of(const block_t *block, const block_t *other, double gain) {
    const bool lags = block->lag != LAG_NONE && other->lag != LAG_NONE;
    return fmax(threshold.evidence_margin,
                (lags ? threshold.evidence_margin_part_lag : threshold.evidence_margin_part) * gain);
}

static double gain_of(const suspect_t *suspect, size_t count, const block_t *block) {
    for (size_t i = 0; i < count; i++) {
        if (suspect[i].block == block) {
            return suspect[i].gain;
        }
    }
    return 0.0;
}

static void choose(const suspect_t *suspect, size_t count, const block_t *block, rivals_t *rivals) {
    rivals->gain = gain_of(suspect, count, block);
    for (size_t i = 0; i < count; i++) {
        const block_t *other = suspect[i].block;
        if (other == block) {
            continue;
        }
        rivals->best_gain = fmax(rivals->best_gain, suspect[i].gain);
        if (rivals->gain >= threshold.evidence_margin && rivals->count < RIVALS_MOST &&
            suspect[i].gain > rivals->gain - margin_of(block, other, rivals->gain)) {
            rivals->rival[rivals->count++] = other;
        }
    }
}

/* All that could be simulated; the first ones are refined. Returns how many. To be freed. */
static size_t refined_suspects(fitted_chain_t *fitted, const probe_setting_t *setting, suspect_t **suspect,
                               size_t *count) {
    const scan_t scan = fitted_chain_scan(fitted, setting);
    scan_blocks(&scan, suspect, count, NULL);
    return scan_refine(&scan, *suspect, *count);
}

void rivals_of(fitted_chain_t *fitted, const probe_setting_t *setting, const block_t *block, rivals_t *rivals) {
    suspect_t *suspect;
    size_t count;
    const size_t refined = refined_suspects(fitted, setting, &suspect, &count);
    *rivals = (rivals_t){0};
    choose(suspect, refined, block, rivals);
    suspects_free(suspect, count);
}

bool loudest_of(fitted_chain_t *fitted, const probe_setting_t *setting, suspect_t *loudest) {
    suspect_t *suspect;
    size_t count;
    const size_t refined = refined_suspects(fitted, setting, &suspect, &count);
    const bool loud = refined > 0 && suspect[0].gain >= threshold.least_searched_gain;
    if (loud) {
        *loudest = suspect[0];
        suspect[0].chain = (model_t){0};
    }
    suspects_free(suspect, count);
    return loud;
}
