/* SPDX-License-Identifier: MIT */
/* The sine against sin(). */
#include "hyst/sine.h"
#include "random.h"
#include "unity.h"
#include <math.h>
#include <stdio.h>

#define TURN 4294967296.0 /* 2^32 */

static random_t rng;

void setUp(void) {
}
void tearDown(void) {
}

static double true_sine(uint32_t phase) {
    return sin(2.0 * acos(-1.0) * (phase / TURN));
}

/* sine.h promises 5 units of 2^-31. The polynomial alone is 1.4e-11 (0.03 units) off; each of its six roundings to
 * Q30 may cost one unit and the last one half, but they do not all come together. */
static void test_sine_is_within_5_units(void) {
    double worst = 0.0;
    for (uint32_t i = 0; i < 4000000U; i++) {
        /* An odd stride visits quadrant limits and everything between; every second phase is random. */
        const uint32_t phase = i % 2U == 0 ? i * 2654435761U : (uint32_t)random_bits(&rng);
        const double exact = fmin(true_sine(phase) * 0x1p31, 0x1p31 - 1.0);
        worst = fmax(worst, fabs(hyst_sine(phase) - exact));
    }
    printf("sine: worst error %.2f * 2^-31 = %.2g of full scale\n", worst, worst * 0x1p-31);
    TEST_ASSERT_TRUE(worst <= 5.0);
}

static void test_sine_at_quarter_turns_and_beside(void) {
    TEST_ASSERT_EQUAL_INT32(0, hyst_sine(0));
    TEST_ASSERT_EQUAL_INT32(0, hyst_sine(0x80000000U));
    TEST_ASSERT_INT32_WITHIN(5, INT32_MAX, hyst_sine(0x40000000U));
    TEST_ASSERT_INT32_WITHIN(5, INT32_MIN, hyst_sine(0xC0000000U));
    for (int32_t beside = -3; beside <= 3; beside++) {
        TEST_ASSERT_INT32_WITHIN(5, INT32_MAX, hyst_sine(0x40000000U + (uint32_t)beside));
        TEST_ASSERT_INT32_WITHIN(5, INT32_MIN, hyst_sine(0xC0000000U + (uint32_t)beside));
        TEST_ASSERT_INT32_WITHIN(5, lround(acos(-1.0) * beside), hyst_sine((uint32_t)beside));
    }
}

int main(void) {
    rng = random_start("test_sine", 20261121);
    UNITY_BEGIN();
    RUN_TEST(test_sine_is_within_5_units);
    RUN_TEST(test_sine_at_quarter_turns_and_beside);
    return UNITY_END();
}
