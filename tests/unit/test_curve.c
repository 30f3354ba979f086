/* SPDX-License-Identifier: MIT */
/* The rising curve: composition with its inverse, monotonicity, ends, an independent reference, refusals. */
#include "hyst/curve.h"
#include "random.h"
#include "unity.h"
#include <math.h>

static random_t rng;

void setUp(void) {
}
void tearDown(void) {
}

/* Slopes from 2^-8 to as steep as the range allows, so that the curve goes beyond neither end. */
static hyst_curve_t random_curve(void) {
    hyst_q31_t node[HYST_CURVE_NODES];
    double slope[HYST_CURVE_INTERVALS], sum = 0.0;
    for (int i = 0; i < HYST_CURVE_INTERVALS; i++) {
        slope[i] = pow(random_unit(&rng), random_bits(&rng) % 2U != 0 ? 8.0 : 0.5);
        sum += slope[i];
    }
    double at = -1.0 + 0.3 * random_unit(&rng);
    const double span = (0.999 - at) - 1.01 / 16.0 / 256.0 * HYST_CURVE_INTERVALS;
    node[0] = (hyst_q31_t)(at * 0x1p31);
    for (int i = 0; i < HYST_CURVE_INTERVALS; i++) {
        at += 1.005 / 16.0 / 256.0 + span * slope[i] / sum;
        node[i + 1] = (hyst_q31_t)(at * 0x1p31);
    }
    hyst_curve_t curve;
    uint32_t element;
    TEST_ASSERT_EQUAL_INT(HYST_CURVE_OK, hyst_curve_build(&curve, node, &element));
    return curve;
}

static hyst_q31_t anywhere(const hyst_curve_t *curve) {
    switch (random_bits(&rng) % 4U) {
    case 0:
        return random_q31(&rng);
    case 1: /* beside a node of the argument */
        return hyst_saturate((int64_t)HYST_Q31_MIN + ((int64_t)(random_bits(&rng) % 33U) << 27) +
                             random_between(&rng, -2, 2));
    case 2: /* beside a node's value */
        return hyst_add(curve->node[random_bits(&rng) % 33U], random_between(&rng, -2, 2));
    default:
        return random_bits(&rng) % 2U != 0 ? HYST_Q31_MAX : HYST_Q31_MIN;
    }
}

static double slope_at(const hyst_curve_t *curve, hyst_q31_t x) {
    const unsigned i = (unsigned)(((int64_t)x - HYST_Q31_MIN) >> 27);
    return ((double)curve->node[i + 1] - curve->node[i]) * 0x1p-27;
}

static void test_composition_and_order(void) {
    for (int run = 0; run < 2000; run++) {
        const hyst_curve_t curve = random_curve();
        for (int k = 0; k < 1000; k++) {
            bool saturated = false;
            const hyst_q31_t y = anywhere(&curve), x = hyst_curve_solve(&curve, y, &saturated);
            TEST_ASSERT_EQUAL(y < curve.node[0] || y > curve.node[HYST_CURVE_INTERVALS], saturated);
            const hyst_q31_t back = hyst_curve_apply(&curve, x);
            if (y <= curve.node[0]) {
                TEST_ASSERT_EQUAL_INT32(HYST_Q31_MIN, x);
            } else if (y >= curve.node[HYST_CURVE_INTERVALS]) {
                TEST_ASSERT_EQUAL_INT32(HYST_Q31_MAX, x);
            } else {
                /* x is half a unit off, y rounded by half a unit more. Next to a node either slope may count, and +1
                 * itself is not in the range. */
                const double before = slope_at(&curve, hyst_subtract(x, 1)), here = slope_at(&curve, x);
                const double bound = x == HYST_Q31_MAX ? 1.5 * here + 0.5 : 0.5 * fmax(before, here) + 0.5;
                TEST_ASSERT_TRUE(fabs((double)back - y) <= bound);
            }
            const hyst_q31_t other = anywhere(&curve);
            TEST_ASSERT_TRUE((other < x) == (hyst_curve_apply(&curve, other) < hyst_curve_apply(&curve, x)) ||
                             hyst_curve_apply(&curve, other) == hyst_curve_apply(&curve, x));
        }
    }
}

static void test_against_double_precision(void) {
    for (int run = 0; run < 200; run++) {
        const hyst_curve_t curve = random_curve();
        for (int k = 0; k < 1000; k++) {
            const hyst_q31_t x = anywhere(&curve);
            const double place = ((double)x + 0x1p31) / 0x1p27, i = fmin(floor(place), 31.0);
            const double low = curve.node[(int)i], high = curve.node[(int)i + 1];
            /* Half a unit of rounding, and the reference's own of 2^-21. */
            TEST_ASSERT_DOUBLE_WITHIN(0.5 + 1e-6, low + (place - i) * (high - low), hyst_curve_apply(&curve, x));
        }
    }
}

static void test_the_straight_line_changes_nothing(void) {
    hyst_curve_t curve;
    bool saturated = false;
    hyst_curve_identity(&curve);
    for (int k = 0; k < 100000; k++) {
        const hyst_q31_t x = anywhere(&curve);
        /* The last node is one unit short of +1. */
        TEST_ASSERT_INT32_WITHIN(1, x, hyst_curve_apply(&curve, x));
        TEST_ASSERT_INT32_WITHIN(1, x, hyst_curve_solve(&curve, x, &saturated));
    }
}

/* curve.h: h^2 / 8 times the curvature; y = 0.98 x + 0.01 x^2 has curvature 0.02, so 9.8e-6. */
static void test_a_quadratic_part_of_1_percent_is_met_to_1e_5(void) {
    hyst_q31_t node[HYST_CURVE_NODES];
    for (int i = 0; i < HYST_CURVE_NODES; i++) {
        const double x = -1.0 + i / 16.0;
        node[i] = (hyst_q31_t)lround((0.98 * x + 0.01 * x * x) * 0x1p31);
    }
    hyst_curve_t curve;
    uint32_t element = 0;
    TEST_ASSERT_EQUAL_INT(HYST_CURVE_OK, hyst_curve_build(&curve, node, &element));
    double worst = 0.0;
    for (int k = 0; k < 100000; k++) {
        const double y = random_q31(&rng) * 0x1p-33;
        bool saturated = false;
        const double x = hyst_curve_solve(&curve, (hyst_q31_t)(y * 0x1p31), &saturated) * 0x1p-31;
        worst = fmax(worst, fabs(0.98 * x + 0.01 * x * x - y));
    }
    TEST_ASSERT_TRUE(worst <= 0.02 / (16.0 * 16.0 * 8.0) + 2e-9); /* and the rounding of x, y and the nodes */
    TEST_ASSERT_TRUE(worst > 9e-6);                               /* the formula is the error, not only a bound */
}

static void test_refusals(void) {
    const hyst_curve_t good = random_curve();
    uint32_t element;
    for (uint32_t i = 1; i < HYST_CURVE_NODES; i++) {
        hyst_curve_t bad = good, untouched = good;
        bad.node[i] = bad.node[i - 1] + HYST_CURVE_MIN_RISE - 1;
        TEST_ASSERT_EQUAL_INT(HYST_CURVE_NOT_RISING, hyst_curve_build(&untouched, bad.node, &element));
        TEST_ASSERT_EQUAL_UINT32(i, element);
        TEST_ASSERT_EQUAL_MEMORY(&good, &untouched, sizeof good);
    }
}

int main(void) {
    rng = random_start("test_curve", 20261121);
    UNITY_BEGIN();
    RUN_TEST(test_composition_and_order);
    RUN_TEST(test_against_double_precision);
    RUN_TEST(test_the_straight_line_changes_nothing);
    RUN_TEST(test_a_quadratic_part_of_1_percent_is_met_to_1e_5);
    RUN_TEST(test_refusals);
    return UNITY_END();
}
