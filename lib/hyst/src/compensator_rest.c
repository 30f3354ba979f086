/* SPDX-License-Identifier: MIT */
/* Apart from the step: it is not per sample. */
#include "hyst/compensator.h"

/* What the stage that a rest is sought for makes of a reference: in linear mode a drive, else the position that creep
 * and hysteresis have to make together. */
static hyst_q31_t made_of(const hyst_compensator_t *c, hyst_mode_t mode, hyst_q31_t reference) {
    if (mode == HYST_MODE_LINEAR) {
        return hyst_saturate(hyst_round_shift(hyst_product(c->linear_gain, reference), 28) + c->linear_offset);
    }
    hyst_iir_state_t settled;
    bool saturated;
    const hyst_q31_t position = c->reference_curved ? hyst_curve_apply(&c->reference_curve, reference) : reference;
    return c->shape.sections > 0 ? hyst_iir_begin(&c->shape, &settled, position, &saturated) : position;
}

/* The two neighbours between which it makes this, by halves: the nearer one. */
static hyst_q31_t reference_for(const hyst_compensator_t *c, hyst_mode_t mode, hyst_q31_t wanted) {
    const bool falls = made_of(c, mode, HYST_Q31_MAX) < made_of(c, mode, HYST_Q31_MIN);
    int64_t below = HYST_Q31_MIN, above = HYST_Q31_MAX;
    while (above - below > 1) {
        const int64_t middle = below + (above - below) / 2;
        const hyst_q31_t made = made_of(c, mode, (hyst_q31_t)middle);
        if (falls ? made >= wanted : made <= wanted) {
            below = middle;
        } else {
            above = middle;
        }
    }
    const int64_t misses_below = (int64_t)wanted - made_of(c, mode, (hyst_q31_t)below);
    const int64_t misses_above = (int64_t)wanted - made_of(c, mode, (hyst_q31_t)above);
    const bool nearer_above = hyst_magnitude(misses_above) < hyst_magnitude(misses_below);
    return (hyst_q31_t)(nearer_above ? above : below);
}

hyst_q31_t hyst_compensator_rest(const hyst_compensator_t *compensator, hyst_mode_t mode, hyst_q31_t drive,
                                 hyst_q31_t position) {
    switch (mode) {
    case HYST_MODE_LINEAR:
        return reference_for(compensator, mode, drive);
    case HYST_MODE_COMPENSATE:
        return reference_for(compensator, mode, position);
    case HYST_MODE_PARK:
    case HYST_MODE_DIRECT:
        break;
    }
    return drive;
}

hyst_q31_t hyst_compensator_position(const hyst_compensator_t *compensator, const hyst_compensator_state_t *state) {
    return hyst_saturate(hyst_creep_offset(&compensator->creep, &state->creep) +
                         hyst_hysteresis_output(&compensator->hysteresis, &state->memory[state->memory_in_use]));
}
