/* SPDX-License-Identifier: MIT */
#include "hyst/creep.h"

hyst_creep_status_t hyst_creep_build(hyst_creep_t *creep, uint32_t cells, const hyst_creep_cell_t cell[],
                                     uint32_t *element) {
    *element = 0;
    if (cells > HYST_CREEP_MAX_CELLS) {
        return HYST_CREEP_TOO_MANY_CELLS;
    }
    int64_t sum = 0;
    for (uint32_t j = 0; j < cells; j++) {
        *element = j;
        sum += hyst_magnitude(cell[j].gain);
        if (sum > HYST_Q31_MAX) {
            return HYST_CREEP_GAIN_TOO_LARGE;
        }
        if (cell[j].rate <= 0) {
            return HYST_CREEP_RATE_NOT_POSITIVE;
        }
    }
    *element = 0;
    creep->cells = cells;
    for (uint32_t j = 0; j < cells; j++) {
        creep->cell[j] = cell[j];
    }
    return HYST_CREEP_OK;
}

/* Q31 to Q61, |result| <= 2^61. */
static int64_t widen(hyst_q31_t h) {
    return (int64_t)h * HYST_Q30_ONE;
}

void hyst_creep_settle(const hyst_creep_t *creep, hyst_creep_state_t *state, hyst_q31_t h) {
    for (uint32_t j = 0; j < creep->cells; j++) {
        state->level[j] = widen(h);
    }
}

int64_t hyst_creep_offset(const hyst_creep_t *creep, const hyst_creep_state_t *state) {
    /* Q31 level, |.| <= 2^31, times Q31 gain. As the |gain| add up to less than 2^31, the sum stays below 2^62. */
    int64_t sum = 0;
    for (uint32_t j = 0; j < creep->cells; j++) {
        const int64_t rounded = state->level[j] + (HYST_Q30_ONE / 2); /* within 2^61 + 2^31 + 2^29 */
        /* rounded >> 30 fits into 32 bits where rounded lies within 2^61, and so its upper word within 2^29. */
        if ((uint32_t)(rounded >> 32) + (UINT32_C(1) << 29) >= UINT32_C(1) << 30) {
            sum += hyst_product(creep->cell[j].gain, rounded < 0 ? HYST_Q31_MIN : HYST_Q31_MAX);
            continue;
        }
        sum += hyst_product(creep->cell[j].gain, (hyst_q31_t)(uint32_t)((uint64_t)rounded >> 30));
    }
    return hyst_round_shift(sum, 31);
}

void hyst_creep_advance(const hyst_creep_t *creep, hyst_creep_state_t *state, hyst_q31_t h) {
    /* |h - s| < 2^62 + 2^31 in Q61; 31 bits down, rounded, it is Q30 and within 2^31 (which it meets where s has passed
     * the lower end by rounding). Times the rate, Q31, it is Q61 again, below 2^62. The rate is below 1, so s never
     * passes h by more than rounding, and stays within 2^61 + 2^31. */
    const int64_t goal = widen(h) + HYST_Q30_ONE;
    for (uint32_t j = 0; j < creep->cells; j++) {
        const int64_t difference = (goal - state->level[j]) >> 31;
        const int32_t low = (int32_t)(uint32_t)(uint64_t)difference;
        state->level[j] += hyst_product(low, creep->cell[j].rate);
        if (low != difference) { /* 2^31 alone does not fit */
            state->level[j] += (int64_t)creep->cell[j].rate * ((int64_t)1 << 32);
        }
    }
}
