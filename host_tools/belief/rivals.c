/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "belief/rivals.h"
#include "belief/together.h"
#include "thresholds/thresholds.h"
#include <math.h>

/* So many are fitted: those that promise most. */
enum { HEARD = 6 };

/* By how much less evidence another block may have. */
static double margin_of(const block_t *block, const block_t *other, double gain) {
    const bool lags = block->lag != LAG_NONE && other->lag != LAG_NONE;
    return fmax(threshold.evidence_margin,
                (lags ? threshold.evidence_margin_part_lag : threshold.evidence_margin_part) * gain);
}

static double gain_of(const heard_t *heard, size_t count, const block_t *block) {
    for (size_t i = 0; i < count; i++) {
        if (heard[i].block == block) {
            return heard[i].gain;
        }
    }
    return 0.0;
}

static void choose(const heard_t *heard, size_t count, const block_t *block, rivals_t *rivals) {
    rivals->gain = gain_of(heard, count, block);
    for (size_t i = 0; i < count; i++) {
        const block_t *other = heard[i].block;
        if (other == block) {
            continue;
        }
        rivals->best_gain = fmax(rivals->best_gain, heard[i].gain);
        if (rivals->gain >= threshold.evidence_margin && rivals->count < RIVALS_MOST &&
            heard[i].gain > rivals->gain - margin_of(block, other, rivals->gain)) {
            rivals->rival[rivals->count++] = other;
        }
    }
}

void rivals_of(fitted_chain_t *fitted, const probe_setting_t *setting, const block_t *block, rivals_t *rivals) {
    heard_t heard[HEARD];
    const size_t count = together_hear(fitted, setting, heard, HEARD);
    *rivals = (rivals_t){0};
    choose(heard, count, block, rivals);
    for (size_t i = 0; i < count; i++) {
        heard_close(&heard[i]);
    }
}
