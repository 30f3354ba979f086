/* SPDX-License-Identifier: MIT */
#include "hyst/iir.h"
#include "hyst/reciprocal.h"

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

static hyst_iir_pair_t pair(hyst_q28_t first, hyst_q28_t second) {
    return (uint64_t)(uint32_t)second << 32 | (uint32_t)first;
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
        const hyst_iir_section_t *s = &section[i];
        const int64_t gain = (int64_t)s->b0 + s->b1 + s->b2;
        /* |a1| < 2 and |a2| < 1, so the signs can be changed; 1 + a1 + a2 is positive: the stability triangle. */
        iir->section[i] =
            (hyst_iir_coefficients_t){.b = pair(s->b1, s->b2),
                                      .minus_a = pair(-s->a1, -s->a2),
                                      .b0 = s->b0,
                                      .at_rest = (uint32_t)(HYST_Q28_ONE + s->a1 + s->a2),
                                      .reciprocal = hyst_reciprocal((uint32_t)(HYST_Q28_ONE + s->a1 + s->a2)),
                                      .gain = (uint32_t)hyst_magnitude(gain),
                                      .negative = gain < 0 ? 1U : 0U};
    }
    return HYST_IIR_OK;
}

static hyst_iir_section_state_t at_rest(hyst_q31_t y) {
    /* Half a unit in the remainder makes the truncating shift round to nearest. */
    return (hyst_iir_section_state_t){.y1 = y, .y2 = y, .remainder = HALF_UNIT};
}

void hyst_iir_reset(hyst_iir_state_t *state) {
    state->x1 = state->x2 = 0;
    for (uint32_t i = 0; i < HYST_IIR_MAX_SECTIONS; i++) {
        state->section[i] = at_rest(0);
    }
}

/* x gain / at_rest toward zero, saturated, and x gain - result at_rest. |x gain| < 2^63. */
static inline hyst_q31_t at_dc(const hyst_iir_coefficients_t *s, hyst_q31_t x, int64_t *rest) {
    const uint32_t magnitude = x < 0 ? 0U - (uint32_t)x : (uint32_t)x;
    const bool negative = ((uint32_t)x >> 31 ^ s->negative) != 0; /* the product is, or 0 */
    const uint64_t size = (uint64_t)magnitude * s->gain;
    /* Up to 2^31 - 1 for either sign; -2^31 is left to the other way, as what saturates. */
    if ((uint32_t)(size >> 31) < s->at_rest) {
        uint32_t remainder;
        const int32_t y = (int32_t)hyst_divide(size, s->at_rest, s->reciprocal, &remainder);
        *rest = negative ? -(int64_t)remainder : (int64_t)remainder;
        return negative ? -y : y;
    }
    const uint32_t end = (uint32_t)HYST_Q31_MAX + (negative ? 1U : 0U);
    const int64_t over = (int64_t)(size - (uint64_t)end * s->at_rest); /* end at_rest < 2^61 */
    *rest = negative ? -over : over;
    return negative ? HYST_Q31_MIN : HYST_Q31_MAX;
}

void hyst_iir_settle(const hyst_iir_t *iir, hyst_iir_state_t *state, hyst_q31_t x) {
    state->x1 = state->x2 = x;
    for (uint32_t i = 0; i < iir->sections; i++) {
        int64_t rest;
        x = at_dc(&iir->section[i], x, &rest);
        state->section[i] = at_rest(x);
    }
}

/* sum >> 28 does not fit into 32 bits. */
static hyst_q31_t saturated_at(int32_t upper_word, int32_t *remainder, bool *saturated) {
    *remainder = HALF_UNIT;
    *saturated = true;
    return upper_word < 0 ? HYST_Q31_MIN : HYST_Q31_MAX;
}

/* The output of an exact sum, and what it leaves for the next. It fits where the sum lies within 2^59, and so its upper
 * word within 2^27. */
static inline hyst_q31_t rounded(int64_t sum, int32_t *remainder, bool *saturated) {
    const int32_t upper_word = (int32_t)(sum >> 32);
    *remainder = (int32_t)((uint32_t)sum & (uint32_t)(HYST_Q28_ONE - 1));
    if ((uint32_t)upper_word + (UINT32_C(1) << 27) >= UINT32_C(1) << 28) {
        return saturated_at(upper_word, remainder, saturated);
    }
    return (hyst_q31_t)(uint32_t)((uint64_t)sum >> 28);
}

/*
 * Each section settles for what the one before it settled at, and gets what that one makes of its first sample. With
 * x gain = y (1 + a1 + a2) + rest the first sum, b0 x' + (b1 + b2) x - (a1 + a2) y + 1/2, is y + rest + 1/2 + b0 (x' -
 * x): the bound of every sum. On the way it may wrap around.
 */
HYST_APART hyst_q31_t hyst_iir_begin(const hyst_iir_t *iir, hyst_iir_state_t *state, hyst_q31_t x, bool *saturated) {
    hyst_q31_t settled = x;
    state->x1 = state->x2 = x;
    hyst_iir_section_state_t *past = state->section;
    const hyst_iir_coefficients_t *const end = iir->section + iir->sections;
    for (const hyst_iir_coefficients_t *s = iir->section; s < end; s++, past++) {
        int64_t rest;
        const hyst_q31_t y = at_dc(s, settled, &rest);
        uint64_t sum = (uint64_t)(rest + HALF_UNIT);
        sum += (uint64_t)hyst_product(y, HYST_Q28_ONE);
        sum += (uint64_t)hyst_product(s->b0, x);
        sum -= (uint64_t)hyst_product(s->b0, settled);
        past->y2 = y;
        x = rounded((int64_t)sum, &past->remainder, saturated);
        past->y1 = x;
        settled = y;
    }
    return x;
}

/* One section. *x1 and *x2 are the past of its input, and become that of its output: the next section's. */
static inline hyst_q31_t section_step(const hyst_iir_coefficients_t *s, hyst_iir_section_state_t *past, hyst_q31_t x,
                                      hyst_q31_t *x1, hyst_q31_t *x2, bool *saturated) {
    const hyst_q31_t y1 = past->y1;
    const hyst_q31_t y2 = past->y2;
    /* |sum| < 15 * 2^28 * 2^31 + 2^28 < 2^63. */
    int64_t sum = (uint32_t)past->remainder;
    sum += hyst_product(s->b0, x);
    const hyst_iir_pair_t b = s->b;
    sum += hyst_product(hyst_iir_first(b), *x1);
    sum += hyst_product(hyst_iir_second(b), *x2);
    const hyst_iir_pair_t minus_a = s->minus_a;
    sum += hyst_product(hyst_iir_first(minus_a), y1);
    sum += hyst_product(hyst_iir_second(minus_a), y2);
    const hyst_q31_t y = rounded(sum, &past->remainder, saturated);
    past->y2 = y1;
    past->y1 = y;
    *x1 = y1;
    *x2 = y2;
    return y;
}

/* Written out: a loop over so few sections costs a sixth of them. */
_Static_assert(HYST_IIR_MAX_SECTIONS == 4, "sections are written out");

HYST_APART hyst_q31_t hyst_iir_pass(hyst_q31_t x, const hyst_iir_t *iir, hyst_iir_state_t *state, bool *saturated) {
    const uint32_t sections = iir->sections;
    hyst_q31_t x1 = state->x1;
    hyst_q31_t x2 = state->x2;
    state->x1 = x;
    state->x2 = x1;
    x = section_step(&iir->section[0], &state->section[0], x, &x1, &x2, saturated);
    if (sections == 1) {
        return x;
    }
    x = section_step(&iir->section[1], &state->section[1], x, &x1, &x2, saturated);
    if (sections == 2) {
        return x;
    }
    x = section_step(&iir->section[2], &state->section[2], x, &x1, &x2, saturated);
    if (sections == 3) {
        return x;
    }
    return section_step(&iir->section[3], &state->section[3], x, &x1, &x2, saturated);
}
