/* SPDX-License-Identifier: MIT */
/* hyst_divide and hyst_divide_once are the compiler's division: random operands of every size, and those at which an
 * estimate tips over. */
#include "hyst/reciprocal.h"
#include "random.h"
#include "unity.h"

static random_t rng;

void setUp(void) {
}
void tearDown(void) {
}

static void same(uint64_t dividend, uint32_t divisor) {
    uint32_t remainder = 0;
    TEST_ASSERT_EQUAL_UINT32((uint32_t)(dividend / divisor),
                             hyst_divide(dividend, divisor, hyst_reciprocal(divisor), &remainder));
    TEST_ASSERT_EQUAL_UINT32((uint32_t)(dividend % divisor), remainder);
    TEST_ASSERT_EQUAL_UINT64(dividend / divisor, hyst_divide_once(dividend, divisor));
}

/* Sizes are as likely as each other; one in four all ones or a power of two, or next to it. */
static uint32_t any_size(void) {
    const uint32_t bits = (uint32_t)random_bits(&rng) >> (random_bits(&rng) % 32U);
    const uint32_t power = UINT32_C(1) << (random_bits(&rng) % 32U);
    return random_unit(&rng) < 0.75 ? bits : power + (uint32_t)random_between(&rng, -1, 1);
}

static void test_every_division_is_exact(void) {
    for (int k = 0; k < 5000000; k++) {
        const uint32_t divisor = any_size() | (uint32_t)(k % 2 == 0);
        if (divisor == 0) {
            continue;
        }
        const uint32_t quotient = any_size();
        const uint64_t multiple = (uint64_t)quotient * divisor;
        same(multiple, divisor);
        same(multiple + divisor - 1U, divisor);
        same(multiple + any_size() % divisor, divisor);
        same(multiple > 0 ? multiple - 1U : 0U, divisor);
    }
}

static void test_the_largest_dividends(void) {
    static const uint32_t divisors[] = {1, 2, 3, 0x7FFFFFFFU, 0x80000000U, 0x80000001U, 0xFFFFFFFEU, 0xFFFFFFFFU};
    for (unsigned i = 0; i < sizeof divisors / sizeof divisors[0]; i++) {
        const uint64_t beyond = (uint64_t)divisors[i] << 32;
        for (uint64_t k = 1; k <= 1000 && k <= beyond; k++) {
            same(beyond - k, divisors[i]);
            same(k - 1U, divisors[i]);
        }
    }
}

static void test_a_quotient_of_more_than_32_bits_is_2_to_the_32(void) {
    for (int k = 0; k < 100000; k++) {
        const uint32_t divisor = any_size() | 1U;
        const uint64_t beyond = (uint64_t)divisor << 32;
        TEST_ASSERT_EQUAL_UINT64(UINT64_C(1) << 32, hyst_divide_once(beyond, divisor));
        TEST_ASSERT_EQUAL_UINT64(UINT64_C(1) << 32, hyst_divide_once(beyond | random_bits(&rng), divisor));
        TEST_ASSERT_EQUAL_UINT64(UINT32_MAX, hyst_divide_once(beyond - 1U, divisor));
    }
}

/* Against 128 bits. Wholes of every size, and next to powers of two; rests of every size, and next to the whole. */
static void test_fractions_are_exact(void) {
    for (int k = 0; k < 5000000; k++) {
        const uint64_t power = UINT64_C(1) << (random_bits(&rng) % 62U);
        uint64_t whole = random_unit(&rng) < 0.8 ? (random_bits(&rng) >> 2) >> (random_bits(&rng) % 62U)
                                                 : power + (uint64_t)random_between(&rng, -1, 1);
        whole = whole > 0 ? whole : 1U;
        const double kind = random_unit(&rng);
        const uint64_t rest = kind < 0.7   ? random_bits(&rng) % whole
                              : kind < 0.8 ? whole - 1U
                                           : (random_bits(&rng) >> (random_bits(&rng) % 64U)) % whole;
        const uint64_t expected = (uint64_t)(((unsigned __int128)rest << 33) / whole);
        TEST_ASSERT_TRUE(expected == hyst_fraction(rest, whole));
    }
}

int main(void) {
    rng = random_start("test_reciprocal", 20261123);
    UNITY_BEGIN();
    RUN_TEST(test_every_division_is_exact);
    RUN_TEST(test_the_largest_dividends);
    RUN_TEST(test_a_quotient_of_more_than_32_bits_is_2_to_the_32);
    RUN_TEST(test_fractions_are_exact);
    return UNITY_END();
}
