/* SPDX-License-Identifier: MIT */
#include "hyst/iir.h"

/* Coefficients may add up to less than 15 in magnitude: see the bound in iir.h. */
#define MAGNITUDE_LIMIT (15 * (int64_t)HYST_Q28_ONE)
#define HALF_UNIT       (HYST_Q28_ONE / 2)

static hyst_iir_status_t check(const hyst_iir_section_t *s) {
    if (hyst_magnitude(s->b0) + hyst_magnitude(s->b1) + hyst_magnitude(s->b2) + hyst_magnitude(s->a1) +
            hyst_magnitude(s->a2) >=
        MAGNITUDE_LIMIT) {
        return HYST_IIR_COEFFICIENTS_TOO_LARGE;
    }
    const int64_t one_plus_a2 = (int64_t)HYST_Q28_ONE + s->a2;
    if (hyst_magnitude(s->a2) >= HYST_Q28_ONE || hyst_magnitude(s->a1) >= one_plus_a2) {
        return HYST_IIR_UNSTABLE;
    }
    return HYST_IIR_OK;
}

hyst_iir_status_t hyst_iir_build(hyst_iir_t *iir, uint32_t sections, const hyst_iir_section_t section[],
                                 uint32_t *element) {
    *element = 0;
    if (sections > HYST_IIR_MAX_SECTIONS) {
        return HYST_IIR_TOO_MANY_SECTIONS;
    }
    for (uint32_t i = 0; i < sections; i++) {
        const hyst_iir_status_t status = check(&section[i]);
        if (status != HYST_IIR_OK) {
            *element = i;
            return status;
        }
    }
    iir->sections = sections;
    for (uint32_t i = 0; i < sections; i++) {
        iir->section[i] = section[i];
    }
    return HYST_IIR_OK;
}

static hyst_iir_section_state_t at_rest(hyst_q31_t x, hyst_q31_t y) {
    /* Half a unit in the remainder makes the truncating shift round to nearest. */
    return (hyst_iir_section_state_t){.x1 = x, .x2 = x, .y1 = y, .y2 = y, .remainder = HALF_UNIT};
}

void hyst_iir_reset(hyst_iir_state_t *state) {
    for (uint32_t i = 0; i < HYST_IIR_MAX_SECTIONS; i++) {
        state->section[i] = at_rest(0, 0);
    }
}

void hyst_iir_settle(const hyst_iir_t *iir, hyst_iir_state_t *state, hyst_q31_t x) {
    for (uint32_t i = 0; i < iir->sections; i++) {
        const hyst_iir_section_t *s = &iir->section[i];
        /* |numerator| < 15 * 2^28 and |x| <= 2^31: the product is below 2^63. The denominator is positive by the
         * stability triangle. */
        const int64_t numerator = (int64_t)s->b0 + s->b1 + s->b2;
        const int64_t denominator = (int64_t)HYST_Q28_ONE + s->a1 + s->a2;
        const hyst_q31_t y = hyst_saturate(x * numerator / denominator);
        state->section[i] = at_rest(x, y);
        x = y;
    }
}

static hyst_q31_t section_step(const hyst_iir_section_t *s, hyst_iir_section_state_t *state, hyst_q31_t x,
                               bool *saturated) {
    /* |sum| < 15 * 2^28 * 2^31 + 2^28 < 2^63. */
    const int64_t sum = hyst_product(s->b0, x) + hyst_product(s->b1, state->x1) + hyst_product(s->b2, state->x2) -
                        hyst_product(s->a1, state->y1) - hyst_product(s->a2, state->y2) + state->remainder;
    const int64_t exact = sum >> 28;
    const hyst_q31_t y = hyst_saturate(exact);
    if (y == exact) {
        state->remainder = (int32_t)(sum & (HYST_Q28_ONE - 1));
    } else {
        state->remainder = HALF_UNIT;
        *saturated = true;
    }
    state->x2 = state->x1;
    state->x1 = x;
    state->y2 = state->y1;
    state->y1 = y;
    return y;
}

hyst_q31_t hyst_iir_step(const hyst_iir_t *iir, hyst_iir_state_t *state, hyst_q31_t x, bool *saturated) {
    for (uint32_t i = 0; i < iir->sections; i++) {
        x = section_step(&iir->section[i], &state->section[i], x, saturated);
    }
    return x;
}
