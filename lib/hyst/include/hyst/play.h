/* SPDX-License-Identifier: MIT */
/**
 * The play and the stop operator, the two atoms of hysteresis.
 *
 * Play with threshold r (half the width of the gap):   w = max(v - r, min(v + r, w_previous))
 * Stop with threshold r (the yield level):             e = max(-r, min(r, v - v_previous + e_previous))
 *
 * Source: paper 000, equations (1) to (4); (4) is printed without its "+ r". For the same input and matching memory
 * (w + e = v at the start), play + stop = input at every sample: tests/unit/test_play.c.
 *
 * v, w, e: Q31. r: Q31, 0 <= r. Exact: no rounding; no saturation can show, because a bound that leaves the range
 * would have clamped nothing inside it (max(v - r, -1) and min(v + r, 1) are what the clamp sees, and w lies in [-1,
 * 1)).
 *
 * May be called from: interrupt, main loop, host. Reentrant; the caller owns the memory.
 */
#ifndef HYST_PLAY_H
#define HYST_PLAY_H

#include "hyst/fixed.h"

/** Next memory (and output) of the play operator with threshold r for input v. */
static inline hyst_q31_t hyst_play(hyst_q31_t r, hyst_q31_t v, hyst_q31_t w_previous) {
    return hyst_clamp(w_previous, hyst_subtract(v, r), hyst_add(v, r));
}

/** Next memory (and output) of the stop operator with threshold r when the input goes from v_previous to v. */
static inline hyst_q31_t hyst_stop(hyst_q31_t r, hyst_q31_t v, hyst_q31_t v_previous, hyst_q31_t e_previous) {
    /* |sum| < 2^31 + 2^31 + 2^31: 64 bits. The result is within [-r, r]. */
    const int64_t e = (int64_t)v - v_previous + e_previous;
    if (e > r) {
        return r;
    }
    return e < -(int64_t)r ? -r : (hyst_q31_t)e;
}

#endif
