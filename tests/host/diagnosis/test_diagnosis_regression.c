/* SPDX-License-Identifier: GPL-3.0-or-later */
/* One series in another one: how often chance is taken for a relation, and whether the standard error is one. */
#include "numerics/regression.h"
#include "random.h"
#include "unity.h"
#include <math.h>
#include <stdio.h>

enum { SAMPLES = 6000, RUNS = 400 };
static random_t rng;
static double x[SAMPLES], y[SAMPLES];

void setUp(void) {
}
void tearDown(void) {
}

/* First order noise of variance 1. */
static void fill(double *values, double memory) {
    double n = random_normal(&rng);
    for (size_t k = 0; k < SAMPLES; k++) {
        values[k] = n;
        n = memory * n + sqrt(1.0 - memory * memory) * random_normal(&rng);
    }
}

static void add(double *values, const double *more, double amplitude) {
    for (size_t k = 0; k < SAMPLES; k++) {
        values[k] += amplitude * more[k];
    }
}

/* Runs in which chance passes a threshold that it should pass once in 100. */
static int false_alarms(double memory_x, double memory_y) {
    int alarms = 0;
    for (int run = 0; run < RUNS; run++) {
        fill(x, memory_x);
        fill(y, memory_y);
        const regression_t r = regression_of(x, y, SAMPLES);
        alarms += fabs(r.amplitude) > r.sigma * regression_quantile(&r, 0.01) ? 1 : 0;
    }
    printf("memories %g and %g: %d of %d\n", memory_x, memory_y, alarms, RUNS);
    return alarms;
}

/* 4 of 400 are expected, and more than 12 come once in 1400 tests. */
static void test_chance_is_seldom_a_relation(void) {
    TEST_ASSERT_LESS_THAN_INT(13, false_alarms(0.0, 0.0));
    TEST_ASSERT_LESS_THAN_INT(13, false_alarms(0.999, 0.0));
    TEST_ASSERT_LESS_THAN_INT(13, false_alarms(0.9, 0.9));
    TEST_ASSERT_LESS_THAN_INT(13, false_alarms(0.99, 0.99));
    TEST_ASSERT_LESS_THAN_INT(13, false_alarms(0.999, 0.999)); /* six such times in a run */
}

/* Errors over their standard errors have a variance of 1; from 400 of them it is known to 7 %. */
static void test_the_standard_error_is_one(void) {
    static const double memories[] = {0.0, 0.9, 0.99};
    for (size_t m = 0; m < sizeof memories / sizeof memories[0]; m++) {
        double squares = 0.0;
        for (int run = 0; run < RUNS; run++) {
            fill(x, memories[m]);
            fill(y, memories[m]);
            add(y, x, 0.3);
            const regression_t r = regression_of(x, y, SAMPLES);
            squares += (r.amplitude - 0.3) * (r.amplitude - 0.3) / (r.sigma * r.sigma) / RUNS;
        }
        printf("memory %g: variance %.2f\n", memories[m], squares);
        TEST_ASSERT_DOUBLE_WITHIN(0.3, 1.0, squares);
    }
}

static void test_nothing_in_nothing(void) {
    for (size_t k = 0; k < SAMPLES; k++) {
        x[k] = 0.0;
    }
    fill(y, 0.0);
    const regression_t idle = regression_of(x, y, SAMPLES), none = regression_of(x, y, 0);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, idle.amplitude);
    TEST_ASSERT_TRUE(isinf(idle.sigma) && isinf(none.sigma));
    fill(x, 0.0);
    const regression_t exact = regression_of(x, x, SAMPLES), few = regression_of(x, y, 3);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 1.0, exact.amplitude);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.0, exact.sigma);
    TEST_ASSERT_TRUE(few.degrees >= 1.0 && few.sigma > 0.0);
}

int main(void) {
    rng = random_start("diagnosis_regression", 20261121);
    UNITY_BEGIN();
    RUN_TEST(test_chance_is_seldom_a_relation);
    RUN_TEST(test_the_standard_error_is_one);
    RUN_TEST(test_nothing_in_nothing);
    return UNITY_END();
}
