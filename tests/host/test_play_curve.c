/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Merging play operators: the branch of the merged bank differs from the original by no more than what is reported. */
#include "elements/play_curve.h"
#include "support.h"
#include "unity.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

enum { MOST = 300 };

static const uint64_t seed = 5;

void setUp(void) {
}
void tearDown(void) {
}

/* Output change after a turning point and a drive change of x, straight from the operators. */
static double branch(const play_bank_t *bank, double x) {
    double sum = bank->weight[0] * x;
    for (size_t i = 0; i < bank->operators; i++) {
        sum += bank->weight[i + 1] * fmax(0.0, x - 2.0 * bank->threshold[i]);
    }
    return sum;
}

static void test_reported_error_bounds_every_branch(void) {
    random_t random = {seed};
    printf("seed %llu\n", (unsigned long long)seed);
    for (int turn = 0; turn < 200; turn++) {
        double weight[MOST + 1], threshold[MOST], old_weight[MOST + 1], old_threshold[MOST], worst = 0.0, reported,
                                                                                             r = 0.0;
        const size_t n = 1 + (size_t)(random_unit(&random) * MOST), most = 1 + (size_t)(random_unit(&random) * 64.0);
        play_bank_t bank = {n, weight, threshold}, old = {n, old_weight, old_threshold};
        weight[0] = random_unit(&random);
        for (size_t i = 0; i < n; i++) { /* the last thresholds lie beyond the range */
            r += 2.2 * random_unit(&random) / (double)n;
            threshold[i] = r + 1e-9;
            weight[i + 1] = (random_unit(&random) - 0.2) / (double)n;
        }
        memcpy(old_weight, weight, sizeof weight);
        memcpy(old_threshold, threshold, sizeof threshold);
        reported = play_bank_thin(&bank, most, 1.0, 0.0, 0.0);
        TEST_ASSERT_TRUE(bank.operators <= most);
        for (size_t i = 0; i < bank.operators; i++) {
            TEST_ASSERT_TRUE(bank.threshold[i] > (i > 0 ? bank.threshold[i - 1] : 0.0) && bank.threshold[i] < 1.0);
        }
        for (int k = 0; k <= 4000; k++) {
            const double x = 2.0 * k / 4000.0;
            worst = fmax(worst, fabs(branch(&bank, x) - branch(&old, x)));
        }
        TEST_ASSERT_TRUE(worst <= reported + 1e-12);
        TEST_ASSERT_TRUE(worst >=
                         0.5 * reported -
                             1e-12); /* the report is the error, not a loose bound (4000 points see most of it) */
    }
}

static void test_nothing_to_merge_leaves_the_bank_alone(void) {
    double weight[] = {1.0, 0.5, 0.25}, threshold[] = {0.25, 0.5};
    play_bank_t bank = {2, weight, threshold};
    TEST_ASSERT_EQUAL_DOUBLE(0.0, play_bank_thin(&bank, 64, 1.0, 1e-9, 1e-6));
    TEST_ASSERT_EQUAL_UINT64(2, bank.operators);
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, 1.0, weight[0]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, 0.5, weight[1]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, 0.25, weight[2]);
    TEST_ASSERT_EQUAL_DOUBLE(0.25, threshold[0]);
}

static void test_operators_beyond_the_range_and_too_close_ones_go(void) {
    double weight[] = {1.0, 0.5, 0.25, 3.0}, threshold[] = {0.25, 0.25 + 1e-9, 1.5};
    play_bank_t bank = {3, weight, threshold};
    TEST_ASSERT_TRUE(play_bank_thin(&bank, 64, 1.0, 0.0, 1e-6) < 1e-8);
    TEST_ASSERT_EQUAL_UINT64(1, bank.operators);
    TEST_ASSERT_DOUBLE_WITHIN(1e-8, 0.75, weight[1]);
}

static void test_a_bank_without_operators_is_a_gain(void) {
    double weight[] = {2.0};
    play_bank_t bank = {0, weight, NULL};
    TEST_ASSERT_EQUAL_DOUBLE(0.0, play_bank_thin(&bank, 64, 1.0, 0.0, 0.0));
    TEST_ASSERT_EQUAL_UINT64(0, bank.operators);
    TEST_ASSERT_EQUAL_DOUBLE(2.0, weight[0]);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_reported_error_bounds_every_branch);
    RUN_TEST(test_nothing_to_merge_leaves_the_bank_alone);
    RUN_TEST(test_operators_beyond_the_range_and_too_close_ones_go);
    RUN_TEST(test_a_bank_without_operators_is_a_gain);
    return UNITY_END();
}
