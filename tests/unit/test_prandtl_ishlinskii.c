/* SPDX-License-Identifier: MIT */
/* The forward model against an independent reference; the shape of its memory; what the builder refuses. */
#include "hyst/play.h"
#include "reference.h"
#include "unity.h"
#include <math.h>
#include <stdlib.h>

static random_t rng;

void setUp(void) {
}
void tearDown(void) {
}

static const uint32_t sizes[] = {0, 1, 2, 10, 64, HYST_PI_MAX_OPERATORS};
#define SIZES (sizeof sizes / sizeof sizes[0])

/*
 * Rate-independent: plays are exact, weights are the same numbers, so only the final rounding (1/2 unit) and the
 * reference's own 64-bit mantissa (far below) are left. Rate-dependent: kappa is rounded to Q31 and v to Q30 per
 * sample; the errors of v are contracted by 1 - g and multiplied by beta. With g beta (S_j - S_0) / S_j <= 0.9 and
 * slopes <= 4 that is below beta (1 / g + 2) units.
 */
static void compare_with_reference(bool rate_dependent) {
    for (int run = 0; run < 60; run++) {
        const pi_arguments_t a = pi_random(&rng, sizes[random_bits(&rng) % SIZES], rate_dependent);
        const hyst_pi_t model = pi_accept(&a);
        reference_pi_t reference = reference_pi(&a);
        hyst_pi_state_t state;
        hyst_pi_reset(&model, &state, 0);
        const double beta = a.beta * 0x1p-20;
        const double bound = 0.51 + (rate_dependent ? 4.0 * (1.0 + beta * (1.0 / (a.rate_gain * 0x1p-30) + 2.0)) : 0.0);
        int32_t drive = 0;
        for (int k = 0; k < 3000; k++) {
            drive = random_unit(&rng) < 0.1 ? random_q31(&rng) : hyst_add(drive, random_q31(&rng) / 64);
            const double expected = (double)(reference_pi_forward(&reference, drive * 0x1p-31L) * 0x1p31L);
            const double got = hyst_pi_forward(&model, &state, drive);
            const double limited = fmin(fmax(expected, INT32_MIN), INT32_MAX);
            TEST_ASSERT_TRUE_MESSAGE(fabs(got - limited) <= bound, "forward model differs from the reference");
        }
    }
}

static void test_forward_equals_reference_with_fixed_thresholds(void) {
    compare_with_reference(false);
}

static void test_forward_equals_reference_with_rate_dependent_thresholds(void) {
    compare_with_reference(true);
}

/* |z_{i+1} - z_i| <= a_{i+1} - a_i: what the inverse's walk relies on, for any input and any rate. */
static void test_memory_stays_nested(void) {
    for (int run = 0; run < 100; run++) {
        const pi_arguments_t a = pi_random(&rng, 64, run % 2 == 1);
        const hyst_pi_t model = pi_accept(&a);
        hyst_pi_state_t state;
        hyst_pi_reset(&model, &state, random_q31(&rng));
        for (int k = 0; k < 2000; k++) {
            const int32_t drive =
                random_unit(&rng) < 0.3 ? random_q31(&rng) : hyst_add(state.drive, random_q31(&rng) / 128);
            hyst_pi_advance(&model, &state, drive);
            for (uint32_t i = 1; i < model.operators; i++) {
                const int64_t distance =
                    llabs((int64_t)hyst_pi_memory(&model, &state, i) - hyst_pi_memory(&model, &state, i - 1));
                TEST_ASSERT_TRUE(distance <= (int64_t)model.threshold[i] - model.threshold[i - 1]);
            }
        }
    }
}

/* Wiping out and return-point memory: closing a minor loop restores the output to the bit. */
static void test_minor_loops_close(void) {
    for (int run = 0; run < 2000; run++) {
        const pi_arguments_t a = pi_random(&rng, 10, false);
        const hyst_pi_t model = pi_accept(&a);
        hyst_pi_state_t state;
        hyst_pi_reset(&model, &state, random_q31(&rng));
        const int32_t high = random_q31(&rng);
        (void)hyst_pi_forward(&model, &state, high);
        const int32_t low = random_between(&rng, INT32_MIN, high);
        const int32_t before = hyst_pi_forward(&model, &state, low);
        int32_t top = random_between(&rng, low, high);
        for (int k = 0; k < 5; k++) { /* nested excursions inside [low, top] */
            (void)hyst_pi_forward(&model, &state, top);
            top = random_between(&rng, low, top);
            (void)hyst_pi_forward(&model, &state, random_between(&rng, low, top));
        }
        TEST_ASSERT_EQUAL_INT32(before, hyst_pi_forward(&model, &state, low));
    }
}

/* Equal small loops at different bias have equal shape (congruency) as long as nothing saturates: height to within
 * rounding. */
static void test_minor_loops_are_congruent(void) {
    const pi_arguments_t a = pi_seed_004(HYST_Q30_ONE / 4);
    pi_arguments_t rate_independent = a;
    rate_independent.beta = 0;
    const hyst_pi_t model = pi_accept(&rate_independent);
    int32_t first = 0;
    for (int bias = -5; bias <= 5; bias++) {
        hyst_pi_state_t state;
        hyst_pi_reset(&model, &state, 0);
        (void)hyst_pi_forward(&model, &state, INT32_MIN);
        const int32_t low = bias * (INT32_MAX / 10);
        const int32_t bottom = hyst_pi_forward(&model, &state, low);
        const int32_t height = hyst_pi_forward(&model, &state, low + INT32_MAX / 8);
        (void)hyst_pi_forward(&model, &state, low);
        const int32_t again = hyst_pi_forward(&model, &state, low + INT32_MAX / 8);
        TEST_ASSERT_EQUAL_INT32(height, again);
        const int32_t fall = again - hyst_pi_forward(&model, &state, low);
        if (bias == -5) {
            first = fall;
        }
        TEST_ASSERT_INT32_WITHIN(1, first, fall); /* two roundings of 1/2 unit each */
        TEST_ASSERT_TRUE(height > bottom);
    }
}

static hyst_pi_status_t build(const pi_arguments_t *a, uint32_t *element) {
    hyst_pi_t model;
    return hyst_pi_build(&model, a->operators, a->offset, a->weight, a->threshold, a->beta, a->rate_gain, element);
}

static void refused(const pi_arguments_t *a, hyst_pi_status_t status, uint32_t expected_element) {
    uint32_t element = 99;
    TEST_ASSERT_EQUAL_INT(status, build(a, &element));
    TEST_ASSERT_EQUAL_UINT32(expected_element, element);
}

static void test_builder_refuses_what_is_not_invertible(void) {
    const pi_arguments_t good = pi_seed_004(HYST_Q30_ONE / 2);
    uint32_t element;
    TEST_ASSERT_EQUAL_INT(HYST_PI_OK, build(&good, &element));

    pi_arguments_t bad = good;
    bad.operators = HYST_PI_MAX_OPERATORS + 1;
    refused(&bad, HYST_PI_TOO_MANY_OPERATORS, 0);
    bad = good;
    bad.threshold[0] = 0;
    refused(&bad, HYST_PI_THRESHOLD_NOT_POSITIVE, 0);
    bad = good;
    bad.threshold[4] = bad.threshold[3];
    refused(&bad, HYST_PI_THRESHOLD_NOT_RISING, 4);
    bad = good;
    bad.threshold[4] = -1;
    refused(&bad, HYST_PI_THRESHOLD_NOT_POSITIVE, 4);
    bad = good;
    bad.weight[0] = HYST_PI_MIN_SLOPE - 1;
    refused(&bad, HYST_PI_SLOPE_TOO_SMALL, 0);
    bad = good;
    bad.weight[0] = HYST_Q28_ONE;
    bad.weight[3] = -2 * HYST_Q28_ONE; /* S_3 < 0 */
    refused(&bad, HYST_PI_SLOPE_TOO_SMALL, 3);
    bad = good;
    bad.weight[7] = INT32_MAX;
    refused(&bad, HYST_PI_WEIGHT_SUM_TOO_LARGE, 7);
    bad = good;
    bad.weight[7] = INT32_MIN; /* its magnitude does not fit into 32 bits */
    refused(&bad, HYST_PI_WEIGHT_SUM_TOO_LARGE, 7);
    bad = good;
    bad.beta = -1;
    refused(&bad, HYST_PI_BETA_NEGATIVE, 0);
    bad = good;
    bad.rate_gain = 0;
    refused(&bad, HYST_PI_RATE_GAIN_OUT_OF_RANGE, 0);
    bad.rate_gain = HYST_Q30_ONE + 1;
    refused(&bad, HYST_PI_RATE_GAIN_OUT_OF_RANGE, 0);
    bad.rate_gain = HYST_Q30_ONE; /* paper 004 unsmoothed: q_1 = 2.066 * 0.6893 / 1.5408 = 0.92 */
    refused(&bad, HYST_PI_RATE_FEEDBACK_UNSTABLE, 1);
}

static void test_refusal_leaves_the_model_alone(void) {
    pi_arguments_t a = pi_seed_004(HYST_Q30_ONE / 2);
    hyst_pi_t model = pi_accept(&a);
    const hyst_pi_t before = model;
    uint32_t element;
    a.threshold[9] = a.threshold[8];
    a.offset = 77;
    TEST_ASSERT_NOT_EQUAL(
        HYST_PI_OK, hyst_pi_build(&model, a.operators, a.offset, a.weight, a.threshold, a.beta, a.rate_gain, &element));
    TEST_ASSERT_EQUAL_MEMORY(&before, &model, sizeof model);
}

/* min(beta |v|, 1 - a_n), where it is cut and beside that. Plays of weight 0 make any beta stable, and an unsmoothed
 * rate is half of the step. */
static void test_growth_up_to_its_limit(void) {
    const hyst_q28_t weight[2] = {HYST_Q28_ONE, 0};
    unsigned cut = 0, below = 0;
    for (int run = 0; run < 20000; run++) {
        const hyst_q31_t threshold = random_between(&rng, 1, INT32_MAX) | (run % 100 == 0 ? INT32_MAX : 0);
        const hyst_q20_t beta = 1 + (random_between(&rng, 0, INT32_MAX - 1) >> (random_bits(&rng) % 31U));
        hyst_pi_t model;
        uint32_t element;
        TEST_ASSERT_EQUAL_INT(HYST_PI_OK,
                              hyst_pi_build(&model, 1, 0, weight, &threshold, beta, HYST_Q30_ONE, &element));
        const int64_t limit = INT32_MAX - threshold;
        const int64_t at_limit = ((limit + 1) << 19) / beta; /* about where it is cut */
        const int64_t rate = run % 4 == 3 ? random_between(&rng, 0, (1 << 30) - 1) : at_limit + run % 4 - 1;
        if (rate < 0 || rate >= 1 << 30) {
            continue;
        }
        hyst_pi_state_t state;
        hyst_pi_reset(&model, &state, 0);
        hyst_pi_advance(&model, &state, (hyst_q31_t)(random_unit(&rng) < 0.5 ? 2 * rate : -2 * rate));
        const int64_t exact = (beta * rate + (1 << 18)) >> 19;
        TEST_ASSERT_EQUAL_INT32(exact < limit ? exact : limit, state.growth);
        cut += exact > limit ? 1U : 0U;
        below += exact < limit ? 1U : 0U;
    }
    TEST_ASSERT_TRUE(cut > 1000 && below > 1000);
}

int main(void) {
    rng = random_start("test_prandtl_ishlinskii", 20261121);
    UNITY_BEGIN();
    RUN_TEST(test_forward_equals_reference_with_fixed_thresholds);
    RUN_TEST(test_forward_equals_reference_with_rate_dependent_thresholds);
    RUN_TEST(test_memory_stays_nested);
    RUN_TEST(test_minor_loops_close);
    RUN_TEST(test_minor_loops_are_congruent);
    RUN_TEST(test_builder_refuses_what_is_not_invertible);
    RUN_TEST(test_refusal_leaves_the_model_alone);
    RUN_TEST(test_growth_up_to_its_limit);
    return UNITY_END();
}
