/* SPDX-License-Identifier: MIT */
/*
 * Bounds used below. hyst_pi_build enforces sum |w_i| <= 4, that is 2^30 in Q28; hence |w_i| <= 2^30 and 2^20 <= S_j <=
 * 2^30. Signals are below 2^31 in magnitude, so products are below 2^61 and the whole weighted sum is too: W = sum w_i
 * z_i, |W| <= 2^61 (Q59).
 */
#include "hyst/prandtl_ishlinskii.h"
#include "hyst/play.h"

/* The limits 0.9 and -0.45 on the rate feedback, in Q20. docs/MODELS.md, section 3.4. */
#define FEEDBACK_MAX ((hyst_q20_t)(HYST_Q20_ONE / 10 * 9))
#define FEEDBACK_MIN (-(hyst_q20_t)(HYST_Q20_ONE / 20 * 9))

static int64_t magnitude(int64_t x) {
    return x < 0 ? -x : x;
}

static hyst_pi_status_t check_thresholds(uint32_t operators, const hyst_q31_t threshold[], uint32_t *element) {
    for (uint32_t i = 0; i < operators; i++) {
        *element = i;
        if (threshold[i] <= 0) {
            return HYST_PI_THRESHOLD_NOT_POSITIVE;
        }
        if (i > 0 && threshold[i] <= threshold[i - 1]) {
            return HYST_PI_THRESHOLD_NOT_RISING;
        }
    }
    return HYST_PI_OK;
}

static hyst_pi_status_t check_weights(uint32_t operators, const hyst_q28_t weight[], uint32_t *element) {
    int64_t sum = 0;   /* |sum| <= 65 * 2^31 */
    int64_t slope = 0; /* likewise */
    for (uint32_t j = 0; j <= operators; j++) {
        *element = j;
        sum += magnitude(weight[j]);
        if (sum > HYST_PI_MAX_WEIGHT_SUM) {
            return HYST_PI_WEIGHT_SUM_TOO_LARGE;
        }
        slope += weight[j];
        if (slope < HYST_PI_MIN_SLOPE) {
            return HYST_PI_SLOPE_TOO_SMALL;
        }
    }
    return HYST_PI_OK;
}

/* q_j = g beta (S_j - S_0) / S_j must lie in [-0.45, 0.9] for every branch j. Weights were checked before. */
static hyst_pi_status_t check_rate(uint32_t operators, const hyst_q28_t weight[], hyst_q20_t beta, hyst_q30_t rate_gain,
                                   uint32_t *element) {
    *element = 0;
    if (beta < 0) {
        return HYST_PI_BETA_NEGATIVE;
    }
    if (beta > 0 && (rate_gain <= 0 || rate_gain > HYST_Q30_ONE)) {
        return HYST_PI_RATE_GAIN_OUT_OF_RANGE;
    }
    if (beta == 0) {
        return HYST_PI_OK;
    }
    /* Q20, rounded up, <= 2^31; with |moving| <= 2^30 the product is below 2^62. The slope's side is below 2^51. */
    const int64_t gain = (hyst_product(beta, rate_gain) + HYST_Q30_ONE - 1) >> 30;
    int64_t moving = 0; /* S_j - S_0 */
    for (uint32_t j = 1; j <= operators; j++) {
        moving += weight[j];
        const int64_t slope = moving + weight[0];
        if (gain * moving > FEEDBACK_MAX * slope || gain * moving < FEEDBACK_MIN * slope) {
            *element = j;
            return HYST_PI_RATE_FEEDBACK_UNSTABLE;
        }
    }
    return HYST_PI_OK;
}

hyst_pi_status_t hyst_pi_build(hyst_pi_t *model, uint32_t operators, hyst_q31_t offset, const hyst_q28_t weight[],
                               const hyst_q31_t threshold[], hyst_q20_t beta, hyst_q30_t rate_gain, uint32_t *element) {
    *element = 0;
    if (operators > HYST_PI_MAX_OPERATORS) {
        return HYST_PI_TOO_MANY_OPERATORS;
    }
    hyst_pi_status_t status = check_thresholds(operators, threshold, element);
    if (status == HYST_PI_OK) {
        status = check_weights(operators, weight, element);
    }
    if (status == HYST_PI_OK) {
        status = check_rate(operators, weight, beta, rate_gain, element);
    }
    if (status != HYST_PI_OK) {
        return status;
    }
    *element = 0;
    model->operators = operators;
    model->offset = offset;
    hyst_q28_t slope = 0; /* 2^20 .. 2^30 by check_weights */
    for (uint32_t j = 0; j <= operators; j++) {
        slope += weight[j];
        model->weight[j] = weight[j];
        model->slope[j] = slope;
    }
    for (uint32_t i = 0; i < operators; i++) {
        model->threshold[i] = threshold[i];
    }
    model->kappa_limit = HYST_Q31_MAX - (operators > 0 ? threshold[operators - 1] : 0);
    model->beta = beta;
    model->rate_gain = beta > 0 ? rate_gain : HYST_Q30_ONE;
    return HYST_PI_OK;
}

/* Common growth of all thresholds, known before the sample. threshold + kappa <= HYST_Q31_MAX by kappa_limit. */
static hyst_q31_t kappa(const hyst_pi_t *model, const hyst_pi_state_t *state) {
    /* beta |v|: Q20 * Q30 = Q50, <= 2^62; 19 bits down is Q31. */
    const int64_t growth = hyst_round_shift((int64_t)model->beta * magnitude(state->rate), 19);
    return growth < model->kappa_limit ? (hyst_q31_t)growth : model->kappa_limit;
}

void hyst_pi_reset(const hyst_pi_t *model, hyst_pi_state_t *state, hyst_q31_t drive) {
    for (uint32_t i = 0; i < model->operators; i++) {
        state->memory[i] = hyst_play(model->threshold[i], drive, 0);
    }
    state->drive = drive;
    state->rate = 0;
}

void hyst_pi_advance(const hyst_pi_t *model, hyst_pi_state_t *state, hyst_q31_t drive) {
    const hyst_q31_t growth = kappa(model, state);
    for (uint32_t i = 0; i < model->operators; i++) {
        state->memory[i] = hyst_play(model->threshold[i] + growth, drive, state->memory[i]);
    }
    if (model->beta > 0) {
        /* Step in Q30, |step| <= 2^31 - 1/2: fits. The new rate lies between the old one and the step, so it fits too.
         */
        const int64_t step = ((int64_t)drive - state->drive) >> 1;
        /* |step - rate| < 2^32, times g <= 2^30: below 2^62. The change alone may need 33 bits, so it is added in 64. */
        state->rate = (hyst_q30_t)(state->rate + hyst_round_shift((step - state->rate) * model->rate_gain, 30));
    }
    state->drive = drive;
}

/* W = sum_{i=1..n} w_i z_i in Q59, |W| <= 2^61. */
static int64_t memory_sum(const hyst_pi_t *model, const hyst_pi_state_t *state) {
    int64_t sum = 0;
    for (uint32_t i = 0; i < model->operators; i++) {
        sum += hyst_product(model->weight[i + 1], state->memory[i]);
    }
    return sum;
}

hyst_q31_t hyst_pi_output(const hyst_pi_t *model, const hyst_pi_state_t *state) {
    /* |w_0 u + W| <= 2^61 together, offset < 2^59 in Q59. */
    const int64_t sum = hyst_product(model->weight[0], state->drive) + memory_sum(model, state);
    return hyst_saturate(hyst_round_shift(sum + hyst_product(model->offset, HYST_Q28_ONE), 28));
}

/*
 * Inverts one side of the response. The side is walked from its first corner outwards; `outward` is +1 for the side
 * where the drive rises and -1 for the other; `rest` > 0 is how far (Q59) the target lies beyond the response at the
 * first corner. Between corner j and j+1 the response has slope S_j. `rest` shrinks from corner to corner, so the last
 * corner before which it is still positive is the one the answer lies behind. The trip count does not depend on the
 * data.
 */
static int64_t walk(const hyst_pi_t *model, const hyst_pi_state_t *state, hyst_q31_t growth, int outward,
                    int64_t rest) {
    int64_t corner = 0;
    int64_t from_corner = 0;
    int64_t from_rest = rest;
    hyst_q28_t from_slope = model->slope[0];
    for (uint32_t i = 0; i < model->operators; i++) {
        const hyst_q31_t threshold = model->threshold[i] + growth;
        /* Saturating is exact enough: no drive lies beyond the range anyway, segments out there get length 0. */
        const int64_t next =
            outward > 0 ? hyst_add(state->memory[i], threshold) : hyst_subtract(state->memory[i], threshold);
        if (i > 0) {
            /* Length < 2^32, slope <= 2^30. All responses at corners are within 2^61, the target within 2^60: |rest| <
             * 2^62.4. */
            rest -= model->slope[i] * magnitude(next - corner);
        }
        if (i == 0 || rest > 0) {
            from_corner = next;
            from_rest = rest;
            from_slope = model->slope[i + 1];
        }
        corner = next;
    }
    /* The one division: rounds the distance to the nearest unit of Q31. < 2^42.4, so the sum cannot overflow. */
    const uint64_t distance = ((uint64_t)from_rest + (uint64_t)from_slope / 2U) / (uint64_t)from_slope;
    return from_corner + outward * (int64_t)distance;
}

hyst_q31_t hyst_pi_solve(const hyst_pi_t *model, const hyst_pi_state_t *state, hyst_q31_t position, bool *saturated) {
    /* |position - offset| < 2^32: |target| < 2^60. */
    const int64_t target = ((int64_t)position - model->offset) * HYST_Q28_ONE;
    const int64_t from_memory = memory_sum(model, state);
    const hyst_q31_t growth = kappa(model, state);

    /* No operator moves while the drive stays within the gap of the first one; without operators it always does. */
    const hyst_q31_t gap = model->operators > 0 ? model->threshold[0] + growth : 0;
    const hyst_q31_t centre = model->operators > 0 ? state->memory[0] : 0;
    const int64_t upper = hyst_product(model->weight[0], hyst_add(centre, gap)) + from_memory;
    const int64_t lower = hyst_product(model->weight[0], hyst_subtract(centre, gap)) + from_memory;

    int64_t drive;
    if (model->operators > 0 && target > upper) {
        drive = walk(model, state, growth, 1, target - upper);
    } else if (model->operators > 0 && target < lower) {
        drive = walk(model, state, growth, -1, lower - target);
    } else {
        /* w_0 = S_0 > 0 and |target - W| < 2^62. C divides toward zero: half a divisor away from zero first makes it
         * the nearest. */
        const int64_t distance = target - from_memory;
        const int64_t half = distance < 0 ? -(model->weight[0] / 2) : model->weight[0] / 2;
        drive = (distance + half) / model->weight[0];
    }
    if (drive > HYST_Q31_MAX || drive < HYST_Q31_MIN) {
        *saturated = true;
    }
    return hyst_saturate(drive);
}

hyst_q31_t hyst_pi_forward(const hyst_pi_t *model, hyst_pi_state_t *state, hyst_q31_t drive) {
    hyst_pi_advance(model, state, drive);
    return hyst_pi_output(model, state);
}

hyst_q31_t hyst_pi_inverse(const hyst_pi_t *model, hyst_pi_state_t *state, hyst_q31_t position, bool *saturated) {
    const hyst_q31_t drive = hyst_pi_solve(model, state, position, saturated);
    hyst_pi_advance(model, state, drive);
    return drive;
}

void hyst_pi_carry(const hyst_pi_t *from, const hyst_pi_state_t *from_state, const hyst_pi_t *to,
                   hyst_pi_state_t *to_state) {
    uint32_t below = 0; /* number of old operators whose threshold is not larger than the new one's */
    for (uint32_t j = 0; j < to->operators; j++) {
        while (below < from->operators && from->threshold[below] <= to->threshold[j]) {
            below++;
        }
        /* The memory curve starts at the drive for threshold 0. */
        const hyst_q31_t curve = below > 0 ? from_state->memory[below - 1] : from_state->drive;
        if (j == 0) {
            to_state->memory[j] = curve;
        } else {
            const hyst_q31_t distance = to->threshold[j] - to->threshold[j - 1];
            to_state->memory[j] = hyst_play(distance, to_state->memory[j - 1], curve);
        }
    }
    to_state->drive = from_state->drive;
    to_state->rate = to->beta > 0 ? from_state->rate : 0;
}
