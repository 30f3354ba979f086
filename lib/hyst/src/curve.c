/* SPDX-License-Identifier: MIT */
#include "hyst/curve.h"

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

hyst_q31_t hyst_curve_solve(const hyst_curve_t *curve, hyst_q31_t y, bool *saturated) {
    uint32_t low = 0;
    uint32_t high = HYST_CURVE_INTERVALS;
    if (y < curve->node[low] || y > curve->node[high]) {
        *saturated = true;
        return y < curve->node[low] ? HYST_Q31_MIN : HYST_Q31_MAX;
    }
    while (high - low > 1U) { /* node[low] <= y <= node[high]; 5 times */
        const uint32_t middle = low + (high - low) / 2U;
        if (curve->node[middle] <= y) {
            low = middle;
        } else {
            high = middle;
        }
    }
    const uint64_t rise = (uint64_t)((int64_t)curve->node[high] - curve->node[low]); /* 2^19 .. 2^32 */
    const uint64_t rest = (uint64_t)((int64_t)y - curve->node[low]);                 /* <= rise */
    const uint64_t inset = ((rest << SHIFT) + rise / 2U) / rise;                     /* <= 2^27 */
    return hyst_saturate(HYST_Q31_MIN + (int64_t)low * WIDTH + (int64_t)inset);
}
