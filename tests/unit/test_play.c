/* SPDX-License-Identifier: MIT */
/* Properties of the fixed-point primitives and of the play and stop operators. */
#include "hyst/play.h"
#include "random.h"
#include "unity.h"

#define SAMPLES 1000000

static random_t rng;

void setUp(void) {
}
void tearDown(void) {
}

/* Values at which fixed-point code breaks. */
static const int32_t edges[] = {INT32_MIN, INT32_MIN + 1, -HYST_Q28_ONE, -1,       0,
                                1,         HYST_Q28_ONE,  INT32_MAX - 1, INT32_MAX};
#define EDGES (sizeof edges / sizeof edges[0])

static int32_t any_value(void) {
    return random_unit(&rng) < 0.2 ? edges[random_bits(&rng) % EDGES] : random_q31(&rng);
}

static int64_t limited(int64_t x) {
    return x > INT32_MAX ? INT32_MAX : x < INT32_MIN ? INT32_MIN : x;
}

static void test_add_and_subtract_saturate(void) {
    for (int k = 0; k < SAMPLES; k++) {
        const int32_t a = any_value();
        const int32_t b = any_value();
        TEST_ASSERT_EQUAL_INT64(limited((int64_t)a + b), hyst_add(a, b));
        TEST_ASSERT_EQUAL_INT64(limited((int64_t)a - b), hyst_subtract(a, b));
    }
}

static void test_round_shift_is_nearest_with_halves_up(void) {
    TEST_ASSERT_EQUAL_INT64(1, hyst_round_shift(1, 1));
    TEST_ASSERT_EQUAL_INT64(0, hyst_round_shift(-1, 1));
    TEST_ASSERT_EQUAL_INT64(2, hyst_round_shift(6, 2));
    TEST_ASSERT_EQUAL_INT64(-1, hyst_round_shift(-6, 2));
    TEST_ASSERT_EQUAL_INT64(INT64_MAX >> 28, hyst_round_shift(INT64_MAX - (INT64_C(1) << 27), 28));
    for (int k = 0; k < SAMPLES; k++) {
        const int64_t x = (int64_t)random_bits(&rng) / 2;
        const unsigned shift = 1U + (unsigned)(random_bits(&rng) % 31U);
        const int64_t rounded = hyst_round_shift(x, shift);
        const int64_t error =
            x - rounded * (INT64_C(1) << shift); /* in (-half, half], halves went up: error is -half */
        const int64_t half = INT64_C(1) << (shift - 1U);
        TEST_ASSERT_TRUE(error >= -half && error < half);
    }
}

/* The definition in exact 64-bit arithmetic, without the saturating shortcuts. */
static int64_t play_by_definition(int64_t r, int64_t v, int64_t w) {
    const int64_t low = v - r;
    const int64_t high = v + r;
    const int64_t inner = high < w ? high : w;
    return low > inner ? low : inner;
}

static void test_play_equals_its_definition(void) {
    for (int k = 0; k < SAMPLES; k++) {
        const int32_t r = any_value() & INT32_MAX;
        const int32_t v = any_value();
        const int32_t w = any_value();
        TEST_ASSERT_EQUAL_INT64(limited(play_by_definition(r, v, w)), hyst_play(r, v, w));
    }
}

static void test_play_plus_stop_is_the_input(void) {
    for (int run = 0; run < 200; run++) {
        const int32_t r = any_value() & INT32_MAX;
        int32_t v = any_value();
        int32_t w = hyst_play(r, v, 0);
        int32_t e = v - w; /* |e| <= r: fits */
        for (int k = 0; k < 5000; k++) {
            const int32_t next = random_unit(&rng) < 0.5 ? any_value() : hyst_add(v, random_between(&rng, -99, 99));
            w = hyst_play(r, next, w);
            e = hyst_stop(r, next, v, e);
            v = next;
            TEST_ASSERT_EQUAL_INT64(v, (int64_t)w + e);
            TEST_ASSERT_TRUE(e <= r && e >= -r);
        }
    }
}

/* A closed excursion that does not pass the turning points restores the memory: return-point memory of one operator. */
static void test_play_remembers_turning_points_only(void) {
    for (int run = 0; run < 20000; run++) {
        const int32_t r = random_between(&rng, 0, INT32_MAX);
        const int32_t high = random_q31(&rng);
        const int32_t low = random_between(&rng, INT32_MIN, high);
        int32_t w = hyst_play(r, high, random_q31(&rng));
        w = hyst_play(r, low, w);
        const int32_t memory = w;
        w = hyst_play(r, random_between(&rng, low, high), w);
        const int32_t inside = w;
        w = hyst_play(r, low, w);
        TEST_ASSERT_EQUAL_INT32(memory, w);
        TEST_ASSERT_TRUE(inside >= memory);
    }
}

int main(void) {
    rng = random_start("test_play", 20261121);
    UNITY_BEGIN();
    RUN_TEST(test_add_and_subtract_saturate);
    RUN_TEST(test_round_shift_is_nearest_with_halves_up);
    RUN_TEST(test_play_equals_its_definition);
    RUN_TEST(test_play_plus_stop_is_the_input);
    RUN_TEST(test_play_remembers_turning_points_only);
    return UNITY_END();
}
