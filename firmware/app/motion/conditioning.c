/* SPDX-License-Identifier: MIT */
#include "motion/conditioning.h"
#include "motion/source.h"

static hyst_q31_t target(const conditioning_t *conditioning, const drive_range_t *range) {
    switch (conditioning->leg) {
    case CONDITIONING_UP:
        return range->high;
    case CONDITIONING_DOWN:
        return range->low;
    case CONDITIONING_OFF:
    case CONDITIONING_TO_PARK:
        break;
    }
    return range->park;
}

void conditioning_start(conditioning_t *conditioning, hyst_q31_t reference) {
    *conditioning = (conditioning_t){.leg = CONDITIONING_UP, .reference = reference};
}

bool conditioning_continues(conditioning_t *conditioning, const drive_range_t *range, hyst_q31_t drive) {
    if (conditioning->leg == CONDITIONING_OFF) {
        return false;
    }
    const hyst_q31_t end = target(conditioning, range);
    if (drive == end && conditioning->reference == end) {
        conditioning->leg = conditioning->leg == CONDITIONING_TO_PARK ? CONDITIONING_OFF : conditioning->leg + 1;
    }
    return conditioning->leg != CONDITIONING_OFF;
}

hyst_q31_t conditioning_step(conditioning_t *conditioning, const drive_range_t *range, hyst_q31_t rate) {
    if (!conditioning->begun) {
        conditioning->begun = true; /* the first sample moves nothing, so the change of mode leaves no transition */
        return conditioning->reference;
    }
    conditioning->reference = source_approach(conditioning->reference, target(conditioning, range), rate);
    return conditioning->reference;
}
