/* SPDX-License-Identifier: MIT */
#include "motion/sweep.h"
#include "hyst/sine.h"

/* ln 2 in Q64. */
#define LN_2 UINT64_C(0xB17217F7D1CF79AC)

/* Upper 64 bits of a product, rounded down by at most 2. */
static uint64_t high_product(uint64_t a, uint64_t b) {
    const uint64_t a1 = a >> 32, a0 = (uint32_t)a, b1 = b >> 32, b0 = (uint32_t)b;
    return a1 * b1 + (a1 * b0 >> 32) + (a0 * b1 >> 32); /* < 2^64: a b / 2^64 is */
}

/* log2(more / less) in Q31, where 1 <= less <= more <= 2^31: at most 31 * 2^31. Digit by digit: squaring doubles the
 * logarithm. */
static uint64_t logarithm(uint32_t less, uint32_t more) {
    uint32_t octaves = 0;
    while (less <= more / 2U) {
        less *= 2U;
        octaves++;
    }
    /* less <= more < 2 less */
    uint64_t mantissa = ((uint64_t)more << 31) / less; /* Q31, [1, 2) */
    uint64_t result = (uint64_t)octaves << 31;
    for (unsigned bit = 31; bit-- > 0;) {
        mantissa = mantissa * mantissa >> 31; /* < 2^64: the factors are below 2^32 */
        if (mantissa >= UINT64_C(1) << 32) {
            mantissa >>= 1;
            result |= UINT64_C(1) << bit;
        }
    }
    return result;
}

/* exp(x) - 1, or 1 - exp(-x), as its series; x < ln 2 in Q64, so the sum is below 1. */
static uint64_t change(uint64_t x, bool falls) {
    uint64_t sum = x, term = x;
    for (uint64_t k = 2; term != 0; k++) {
        term = high_product(term, x) / k;
        sum = falls && k % 2U == 0 ? sum - term : sum + term;
    }
    return sum;
}

static bool logarithmic_step(sweep_t *sweep) {
    const uint64_t octaves =
        sweep->falls ? logarithm(sweep->end, sweep->start) : logarithm(sweep->start, sweep->end); /* < 2^36 */
    if (octaves >> 31 >= sweep->samples) {
        return false; /* an octave a sample or more */
    }
    const uint64_t rate = high_product(octaves << 28, LN_2) / sweep->samples; /* natural, Q59, below ln 2 */
    sweep->step = change(rate << 5, sweep->falls);
    return true;
}

bool sweep_make(uint32_t start, uint32_t end, uint32_t samples, sweep_spacing_t spacing, sweep_t *sweep) {
    const uint32_t most = 2U * HYST_PHASE_QUARTER_TURN;
    if (start < 1 || start > most || end < 1 || end > most || samples < 1 || spacing > SWEEP_LOGARITHMIC) {
        return false;
    }
    *sweep = (sweep_t){.start = start,
                       .end = end,
                       .samples = samples,
                       .falls = end < start,
                       .logarithmic = spacing == SWEEP_LOGARITHMIC};
    if (sweep->logarithmic) {
        return logarithmic_step(sweep);
    }
    sweep->step = ((uint64_t)(sweep->falls ? start - end : end - start) << 32) / samples;
    return true;
}

void sweep_begin(const sweep_t *sweep, sweep_state_t *state) {
    *state = (sweep_state_t){.increment = (uint64_t)sweep->start << 32, .left = sweep->samples};
}

bool sweep_next(const sweep_t *sweep, sweep_state_t *state, uint32_t *phase) {
    if (state->left == 0) {
        if (state->turned) {
            sweep_begin(sweep, state);
            return false;
        }
    } else {
        state->left--;
    }
    *phase = (uint32_t)(state->phase >> 32);
    state->phase += state->increment;
    state->turned = state->phase < state->increment;
    if (state->left == 0) {
        state->increment = (uint64_t)sweep->end << 32;
    } else {
        const uint64_t step = sweep->logarithmic ? high_product(state->increment, sweep->step) : sweep->step;
        state->increment = sweep->falls ? state->increment - step : state->increment + step;
    }
    return true;
}
