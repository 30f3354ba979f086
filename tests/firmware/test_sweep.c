/* SPDX-License-Identifier: MIT */
/* Sweeps against their closed forms: sums of integers for linear ones, long double for logarithmic ones. */
#include "motion/sweep.h"
#include "random.h"
#include "unity.h"
#include <math.h>

#define HALF_A_TURN (UINT32_C(1) << 31)

static random_t rng;

void setUp(void) {
}
void tearDown(void) {
}

static sweep_t made(uint32_t start, uint32_t end, uint32_t samples, sweep_spacing_t spacing) {
    sweep_t sweep;
    TEST_ASSERT_TRUE(sweep_make(start, end, samples, spacing, &sweep));
    return sweep;
}

/* n start + n (n - 1) / 2 step, modulo a turn. */
static void test_a_linear_sweep_has_the_phase_of_its_formula(void) {
    for (int run = 0; run < 200; run++) {
        const uint32_t start = ((uint32_t)random_bits(&rng) >> random_between(&rng, 1, 20)) + 1U;
        const uint32_t end = ((uint32_t)random_bits(&rng) >> random_between(&rng, 1, 20)) + 1U;
        const uint32_t samples = (uint32_t)random_between(&rng, 1, 4000);
        const sweep_t sweep = made(start, end, samples, SWEEP_LINEAR);
        sweep_state_t state;
        sweep_begin(&sweep, &state);
        const uint64_t step = ((uint64_t)(end > start ? end - start : start - end) << 32) / samples;
        for (uint64_t n = 0; n <= samples; n++) {
            uint32_t phase;
            const uint64_t slope = step * (n > 0 ? n * (n - 1U) / 2U : 0);
            const uint64_t exact = n * ((uint64_t)start << 32) + (end > start ? slope : 0U - slope);
            if (!sweep_next(&sweep, &state, &phase)) {
                TEST_ASSERT_EQUAL_UINT64(samples, n); /* the last step ended a turn */
                break;
            }
            TEST_ASSERT_EQUAL_HEX32((uint32_t)(exact >> 32), phase);
        }
        TEST_ASSERT_EQUAL_HEX64((uint64_t)(state.left == 0 ? end : start) << 32, state.increment);
    }
}

static void compare_logarithmic(uint32_t start, uint32_t end, uint32_t samples) {
    const sweep_t sweep = made(start, end, samples, SWEEP_LOGARITHMIC);
    sweep_state_t state;
    sweep_begin(&sweep, &state);
    for (uint32_t n = 0; n < samples; n++) {
        uint32_t phase;
        const long double exact = start * powl((long double)end / start, (long double)n / samples);
        const long double allowed = exact * (1e-8L + n / (0x1p30L * start));
        if (fabsl(state.increment * 0x1p-32L - exact) > allowed) {
            TEST_ASSERT_DOUBLE_WITHIN((double)allowed, (double)exact, (double)state.increment * 0x1p-32);
        }
        TEST_ASSERT_TRUE(sweep_next(&sweep, &state, &phase));
    }
    TEST_ASSERT_EQUAL_HEX64((uint64_t)end << 32, state.increment);
}

static void test_a_logarithmic_sweep_has_equal_factors(void) {
    compare_logarithmic(42950, 429496730, 600000); /* 0.1 Hz to 1 kHz in a minute, at 10 kHz */
    compare_logarithmic(429496730, 42950, 600000);
    compare_logarithmic(1, HALF_A_TURN, 32); /* 31 octaves */
    compare_logarithmic(HALF_A_TURN, 1, 32);
    compare_logarithmic(1000, 1999, 1); /* nearly an octave a sample */
    compare_logarithmic(1999, 1000, 1);
    compare_logarithmic(1000000, 1000001, 3000000);
    compare_logarithmic(77, 77, 1000);
    for (int run = 0; run < 300; run++) {
        const uint32_t start = ((uint32_t)random_bits(&rng) >> random_between(&rng, 1, 24)) + 1U;
        const uint32_t end = ((uint32_t)random_bits(&rng) >> random_between(&rng, 1, 24)) + 1U;
        compare_logarithmic(start, end, (uint32_t)random_between(&rng, 32, 5000));
    }
}

/* No phase is repeated or left out where a pass ends: the last turn is whole, and no turn follows it. */
static void test_a_pass_ends_with_a_whole_turn(void) {
    for (int run = 0; run < 300; run++) {
        const uint32_t start = ((uint32_t)random_bits(&rng) >> random_between(&rng, 3, 20)) + 1U;
        const uint32_t end = ((uint32_t)random_bits(&rng) >> random_between(&rng, 3, 12)) + 1U;
        const uint32_t samples = (uint32_t)random_between(&rng, 32, 3000);
        const sweep_t sweep =
            made(start, end, samples, random_between(&rng, 0, 1) == 0 ? SWEEP_LINEAR : SWEEP_LOGARITHMIC);
        sweep_state_t state;
        sweep_begin(&sweep, &state);
        uint32_t phase, first = 1, last = 0, before = 0;
        for (unsigned pass = 0; pass < 3; pass++) {
            uint32_t n = 0;
            for (; sweep_next(&sweep, &state, &phase); n++) {
                first = n == 0 ? phase : first;
                before = last;
                last = phase;
            }
            TEST_ASSERT_EQUAL_HEX32(0, first);
            TEST_ASSERT_GREATER_OR_EQUAL_UINT32(samples, n);
            TEST_ASSERT_LESS_OR_EQUAL_UINT64(samples + (UINT64_C(1) << 32) / end + 1U, n);
            if (n > samples + 1U) {
                TEST_ASSERT_UINT32_WITHIN(1, end, last - before); /* the tail is at the end's frequency */
                TEST_ASSERT_TRUE((uint64_t)last + end >= (UINT64_C(1) << 32) - 1U);
            }
        }
    }
}

static void test_what_cannot_be_swept_is_refused(void) {
    sweep_t sweep;
    TEST_ASSERT_FALSE(sweep_make(0, 1, 1, SWEEP_LINEAR, &sweep));
    TEST_ASSERT_FALSE(sweep_make(1, 0, 1, SWEEP_LINEAR, &sweep));
    TEST_ASSERT_FALSE(sweep_make(1, 1, 0, SWEEP_LINEAR, &sweep));
    TEST_ASSERT_FALSE(sweep_make(HALF_A_TURN + 1U, 1, 1, SWEEP_LINEAR, &sweep));
    TEST_ASSERT_FALSE(sweep_make(1, HALF_A_TURN + 1U, 1, SWEEP_LINEAR, &sweep));
    TEST_ASSERT_FALSE(sweep_make(1, 1, 1, (sweep_spacing_t)2, &sweep));
    TEST_ASSERT_FALSE(sweep_make(1000, 2000, 1, SWEEP_LOGARITHMIC, &sweep)); /* an octave a sample */
    TEST_ASSERT_FALSE(sweep_make(2000, 1000, 1, SWEEP_LOGARITHMIC, &sweep));
    TEST_ASSERT_FALSE(sweep_make(1, HALF_A_TURN, 31, SWEEP_LOGARITHMIC, &sweep));
    TEST_ASSERT_TRUE(sweep_make(1, HALF_A_TURN, 1, SWEEP_LINEAR, &sweep));
}

int main(void) {
    rng = random_start("firmware_sweep", 20261124);
    UNITY_BEGIN();
    RUN_TEST(test_a_linear_sweep_has_the_phase_of_its_formula);
    RUN_TEST(test_a_logarithmic_sweep_has_equal_factors);
    RUN_TEST(test_a_pass_ends_with_a_whole_turn);
    RUN_TEST(test_what_cannot_be_swept_is_refused);
    return UNITY_END();
}
