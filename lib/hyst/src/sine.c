/* SPDX-License-Identifier: MIT */
#include "hyst/sine.h"

/*
 * sin(pi/2 u) = u * (c0 + c1 u^2 + ... + c5 u^10), the minimax polynomial on -1 <= u <= 1: it alone is wrong by at most
 * 1.4e-11. Coefficients in Q30.
 */
static const hyst_q30_t coefficient[] = {1686629713, -693598663, 85569264, -5026852, 172032, -3670};
#define TERMS (sizeof coefficient / sizeof coefficient[0])

hyst_q31_t hyst_sine(uint32_t phase) {
    /* A quarter turn is 2^30: the phase, as a signed number, is u in Q30. The outer quarters mirror the inner ones. */
    const int32_t quarter_turn = (int32_t)HYST_PHASE_QUARTER_TURN;
    int32_t u = (int32_t)phase;
    if (u > quarter_turn || u < -quarter_turn) {
        u = (int32_t)(2U * HYST_PHASE_QUARTER_TURN - phase);
    }
    /* All products are those of Q30, rounded to nearest. Twice u wraps at the quarter turn, where its square is the
     * same. Negative numbers reach one unit further, so -2 u^2 is what is multiplied: -2^31 .. 0. (4 u^2 lies never
     * half-way between two multiples of 2^32, so -u^2 rounds as u^2 does.) */
    const int32_t twice = (int32_t)(2U * (uint32_t)u);
    const int32_t minus_twice_square = 2 * hyst_subtract_high_product(0, twice, twice);
    hyst_q30_t sum = coefficient[TERMS - 1U];
    for (unsigned i = TERMS - 1U; i-- > 0;) {
        /* |sum| < 2^30 before the last step, and 1.571 in Q30 at most after it. */
        sum = hyst_subtract_high_product(coefficient[i], 2 * sum, minus_twice_square);
    }
    return hyst_saturate(hyst_round_shift(hyst_product(sum, u), 29)); /* Q30 * Q30 = Q60 */
}
