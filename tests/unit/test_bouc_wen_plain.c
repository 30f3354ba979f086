/* SPDX-License-Identifier: MIT */
/* The Bouc-Wen model that keeps what it has found against the one that searches without endything: every bit of the
 * memory, over goals and drives that go anywhere, drives that are applied as found, beside it, limited, or in the other
 * sense. */
#include "bouc_wen_models.h"
#include "bouc_wen_plain.h"
#include "unity.h"
#include <inttypes.h>
#include <stdio.h>

static random_t rng;

void setUp(void) {
}
void tearDown(void) {
}

static hyst_q31_t any_goal(const hyst_bouc_wen_t *model, const hyst_bouc_wen_state_t *state) {
    const hyst_q31_t here = bouc_wen_plain_output(model, state);
    const double kind = random_unit(&rng);
    if (kind < 0.1) {
        return kind < 0.05 ? INT32_MIN : INT32_MAX;
    }
    return kind < 0.3   ? random_q31(&rng)
           : kind < 0.5 ? hyst_add(here, random_between(&rng, -2, 2))
                        : hyst_add(here, random_q31(&rng) >> (random_bits(&rng) % 31U));
}

static void test_equals_the_searches(void) {
    uint64_t turns = 0;
    uint64_t saturations = 0;
    for (int run = 0; run < 1000; run++) {
        const bouc_wen_arguments_t a = bouc_wen_random(&rng);
        const hyst_bouc_wen_t model = bouc_wen_accept(&a);
        hyst_bouc_wen_state_t expected, got;
        const hyst_q31_t start = random_q31(&rng);
        bouc_wen_plain_reset(&model, &expected, start);
        hyst_bouc_wen_reset(&model, &got, start);
        for (int k = 0; k < 2000; k++) {
            const hyst_q31_t goal = any_goal(&model, &expected);
            bool wanted = false;
            bool saturated = false;
            hyst_bouc_wen_found_t found;
            const hyst_q31_t drive = hyst_bouc_wen_find(&model, &got, goal, &saturated, &found);
            TEST_ASSERT_EQUAL_INT32(bouc_wen_plain_solve(&model, &expected, goal, &wanted), drive);
            TEST_ASSERT_EQUAL_INT(wanted, saturated);
            turns += found.turned ? 1U : 0U;
            saturations += saturated ? 1U : 0U;
            const double kind = random_unit(&rng);
            const hyst_q31_t next = kind < 0.6   ? drive
                                    : kind < 0.7 ? hyst_clamp(drive, -(1 << 29), 1 << 29)
                                    : kind < 0.8 ? hyst_add(got.drive, random_between(&rng, -1, 1))
                                                 : random_q31(&rng);
            bouc_wen_plain_advance(&model, &expected, next);
            hyst_bouc_wen_follow(&model, &got, next, &found);
            TEST_ASSERT_TRUE(expected.place == got.place && expected.rest == got.rest && expected.side == got.side &&
                             expected.drive == got.drive);
            TEST_ASSERT_EQUAL_INT32(bouc_wen_plain_output(&model, &expected), hyst_bouc_wen_output(&model, &got));
        }
    }
    printf("%" PRIu64 " turns, %" PRIu64 " goals out of reach\n", turns, saturations);
    TEST_ASSERT_TRUE(turns > 200000 && saturations > 100000);
}

int main(void) {
    rng = random_start("test_bouc_wen_plain", 20261123);
    UNITY_BEGIN();
    RUN_TEST(test_equals_the_searches);
    return UNITY_END();
}
