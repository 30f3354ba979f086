/* SPDX-License-Identifier: MIT */
/* The Preisach model against its plain form, every bit of the memory: goals that go anywhere, and spirals of reversals
 * that keep the stack full, with gaps that shrink, grow or are equal, so that it is merged wherever it can be. */
#include "preisach_models.h"
#include "preisach_plain.h"
#include "unity.h"
#include <inttypes.h>
#include <stdio.h>

static random_t rng;

void setUp(void) {
}
void tearDown(void) {
}

static void same(const hyst_preisach_state_t *expected, const hyst_preisach_state_t *got) {
    TEST_ASSERT_EQUAL_UINT32(expected->extremes, got->extremes);
    TEST_ASSERT_TRUE(expected->now.drive == got->now.drive && expected->now.output == got->now.output);
    for (uint32_t k = 0; k < expected->extremes; k++) {
        TEST_ASSERT_TRUE(expected->extreme[k].drive == got->extreme[k].drive &&
                         expected->extreme[k].output == got->extreme[k].output);
    }
}

static void test_equals_the_plain_form(void) {
    uint64_t merged = 0;
    uint64_t saturations = 0;
    for (int run = 0; run < 1500; run++) {
        const preisach_arguments_t a = preisach_random(&rng, 1U + (uint32_t)(random_bits(&rng) % 30U));
        const hyst_preisach_t model = preisach_accept(&a);
        hyst_preisach_state_t expected, got;
        const hyst_q31_t start = random_q31(&rng);
        preisach_plain_reset(&model, &expected, start);
        hyst_preisach_reset(&model, &got, start);
        same(&expected, &got);
        double swing = 0x1p31;
        double shrink = 0.99;
        for (int k = 0; k < 600; k++) {
            if (random_unit(&rng) < 0.004) {
                swing = 0x1p31;
                shrink = random_unit(&rng) < 0.3 ? 1.0 - 0x1p-24 : 0.9 + 0.0999 * random_unit(&rng);
            }
            swing *= -shrink;
            const hyst_q31_t spiral =
                shrink > 0.9999 ? (hyst_q31_t)swing / 1000000 * 1000000 / 2 : hyst_saturate((int64_t)swing);
            const hyst_q31_t goal = random_unit(&rng) < 0.5 ? random_q31(&rng)
                                                            : hyst_add(preisach_plain_output(&model, &expected),
                                                                       random_q31(&rng) >> (random_bits(&rng) % 31U));
            bool wanted = false;
            bool saturated = false;
            const hyst_q31_t drive = hyst_preisach_solve(&model, &got, goal, &saturated);
            TEST_ASSERT_EQUAL_INT32(preisach_plain_solve(&model, &expected, goal, &wanted), drive);
            TEST_ASSERT_EQUAL_INT(wanted, saturated);
            saturations += saturated ? 1U : 0U;
            const hyst_q31_t next = random_unit(&rng) < 0.97 ? spiral : drive;
            const bool full = expected.extremes == HYST_PREISACH_MAX_EXTREMES;
            preisach_plain_advance(&model, &expected, next);
            hyst_preisach_advance(&model, &got, next);
            merged += full && expected.extremes == HYST_PREISACH_MAX_EXTREMES - 1U ? 1U : 0U;
            same(&expected, &got);
        }
    }
    printf("%" PRIu64 " merged stacks, %" PRIu64 " goals out of reach\n", merged, saturations);
    TEST_ASSERT_TRUE(merged > 10000 && saturations > 10000);
}

int main(void) {
    rng = random_start("test_preisach_plain", 20261123);
    UNITY_BEGIN();
    RUN_TEST(test_equals_the_plain_form);
    return UNITY_END();
}
