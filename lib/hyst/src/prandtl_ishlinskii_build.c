/* SPDX-License-Identifier: MIT */
/* The validator of the Prandtl-Ishlinskii model, and the tables it makes. Bounds as in prandtl_ishlinskii.c. */
#include "hyst/prandtl_ishlinskii.h"
#include "hyst/reciprocal.h"

/* The limits 0.9 and -0.45 on the rate feedback, in Q20. docs/MODELS.md, section 3.4. */
#define FEEDBACK_MAX ((hyst_q20_t)(HYST_Q20_ONE / 10 * 9))
#define FEEDBACK_MIN (-(hyst_q20_t)(HYST_Q20_ONE / 20 * 9))

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
        sum += hyst_magnitude(weight[j]);
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

/* q_j = g beta (S_j - S_0) / S_j must lie in [-0.45, 0.9] without endy branch j. Weights were checked before. */
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

static hyst_pi_slope_t slope_of(hyst_q28_t value) {
    return (hyst_pi_slope_t){.value = value, .reciprocal = hyst_reciprocal((uint32_t)value)};
}

/* The growth is (beta |v| + 2^18) / 2^19, rounded down, and within the limit up to here. */
static uint32_t rate_limit_of(hyst_q20_t beta, hyst_q31_t kappa_limit) {
    const uint64_t most = ((uint64_t)kappa_limit + 1U) * (UINT32_C(1) << 19) - (UINT32_C(1) << 18) - 1U;
    const uint64_t rate = beta > 0 ? most / (uint32_t)beta : UINT32_MAX;
    return rate < UINT32_MAX ? (uint32_t)rate : UINT32_MAX;
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
    model->wide_offset = hyst_times_q28(offset);
    model->slope[0] = slope_of(weight[0]);
    int64_t moment = 0; /* w_1 a_1 + ... + w_i a_i, below 2^61 in magnitude */
    for (uint32_t i = 0; i < operators; i++) {
        model->threshold[i] = threshold[i];
        model->turn[i] = 2 * (hyst_product(model->slope[i].value, threshold[i]) - moment);
        moment += hyst_product(weight[i + 1], threshold[i]);
        model->slope[i + 1] = slope_of(model->slope[i].value + weight[i + 1]); /* 2^20 .. 2^30 by check_weights */
    }
    model->levels = 0;
    while (UINT32_C(1) << model->levels < operators) {
        model->levels++;
    }
    for (uint32_t i = operators; i < UINT32_C(1) << model->levels; i++) {
        model->threshold[i] = HYST_Q31_MAX;
        model->turn[i] = INT64_MAX;
    }
    model->kappa_limit = HYST_Q31_MAX - (operators > 0 ? threshold[operators - 1] : 0);
    model->beta = beta;
    model->rate_limit = rate_limit_of(beta, model->kappa_limit);
    model->rate_gain = beta > 0 ? rate_gain : HYST_Q30_ONE;
    return HYST_PI_OK;
}
