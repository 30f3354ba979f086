/* SPDX-License-Identifier: MIT */
#include "hyst/curve.h"
#include "hyst/reciprocal.h"

/* An interval is 2^27 units of Q31 wide, and 32 of them are the range. */
#define SHIFT 27U
#define WIDTH ((int64_t)1 << SHIFT)

hyst_curve_status_t hyst_curve_build(hyst_curve_t *curve, const hyst_q31_t node[HYST_CURVE_NODES], uint32_t *element) {
    for (uint32_t i = 1; i < HYST_CURVE_NODES; i++) {
        *element = i;
        if ((int64_t)node[i] - node[i - 1U] < HYST_CURVE_MIN_RISE) {
            return HYST_CURVE_NOT_RISING;
        }
    }
    *element = 0;
    for (uint32_t i = 0; i < HYST_CURVE_NODES; i++) {
        curve->node[i] = node[i];
    }
    return HYST_CURVE_OK;
}

void hyst_curve_identity(hyst_curve_t *curve) {
    for (uint32_t i = 0; i < HYST_CURVE_NODES; i++) {
        curve->node[i] = hyst_saturate(HYST_Q31_MIN + (int64_t)i * WIDTH);
    }
}

hyst_q31_t hyst_curve_apply(const hyst_curve_t *curve, hyst_q31_t x) {
    const uint64_t above = (uint64_t)((int64_t)x - HYST_Q31_MIN); /* < 2^32 */
    const uint32_t i = (uint32_t)(above >> SHIFT);                /* 0..31 */
    const int64_t inset = (int64_t)(above & (uint64_t)(WIDTH - 1));
    const int64_t rise = (int64_t)curve->node[i + 1U] - curve->node[i]; /* <= 2^32 */
    /* rise * inset < 2^59. The result lies between two nodes. */
    return (hyst_q31_t)(curve->node[i] + hyst_round_shift(rise * inset, SHIFT));
}

/* The interval in which the curve is y: node[result] <= y <= node[result + 1], where node[0] <= y <= node[32]. */
static inline uint32_t interval_of(const hyst_curve_t *curve, hyst_q31_t y) {
    uint32_t low = 0;
    for (uint32_t half = HYST_CURVE_INTERVALS / 2U; half > 0; half /= 2U) { /* 5 times */
        low = curve->node[low + half] <= y ? low + half : low;
    }
    return low;
}

static inline bool outside(const hyst_curve_t *curve, hyst_q31_t y, hyst_q31_t *end) {
    *end = y < curve->node[0] ? HYST_Q31_MIN : HYST_Q31_MAX;
    return y < curve->node[0] || y > curve->node[HYST_CURVE_INTERVALS];
}

static inline uint32_t rise_of(const hyst_curve_t *curve, uint32_t i) {
    /* 2^19 .. 2^32 - 1: the other intervals rise, too. */
    return (uint32_t)curve->node[i + 1U] - (uint32_t)curve->node[i];
}

/* Half the rise more: rounds to nearest. */
static inline uint64_t dividend_of(const hyst_curve_t *curve, uint32_t i, hyst_q31_t y, uint32_t rise) {
    const uint64_t rest = (uint32_t)y - (uint32_t)curve->node[i]; /* <= rise */
    return (rest << SHIFT) + rise / 2U;                           /* < 2^60 */
}

static inline hyst_q31_t place(uint32_t i, uint32_t inset) {
    return hyst_saturate(HYST_Q31_MIN + (int64_t)i * WIDTH + inset); /* inset <= 2^27 */
}

hyst_q31_t hyst_curve_solve(const hyst_curve_t *curve, hyst_q31_t y, bool *saturated) {
    hyst_q31_t end;
    if (outside(curve, y, &end)) {
        *saturated = true;
        return end;
    }
    const uint32_t i = interval_of(curve, y);
    const uint32_t rise = rise_of(curve, i);
    return place(i, (uint32_t)(dividend_of(curve, i, y, rise) / rise));
}

void hyst_curve_invert(const hyst_curve_t *curve, hyst_curve_inverse_t *inverse) {
    for (uint32_t i = 0; i < HYST_CURVE_INTERVALS; i++) {
        inverse->reciprocal[i] = hyst_reciprocal(rise_of(curve, i));
    }
}

hyst_q31_t hyst_curve_solve_by(const hyst_curve_t *curve, const hyst_curve_inverse_t *inverse, hyst_q31_t y,
                               bool *saturated) {
    hyst_q31_t end;
    if (outside(curve, y, &end)) {
        *saturated = true;
        return end;
    }
    const uint32_t i = interval_of(curve, y);
    const uint32_t rise = rise_of(curve, i);
    uint32_t remainder;
    return place(i, hyst_divide(dividend_of(curve, i, y, rise), rise, inverse->reciprocal[i], &remainder));
}
