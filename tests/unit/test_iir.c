/* SPDX-License-Identifier: MIT */
/* Biquad cascade: against double precision, exact gain at rest, what it refuses, saturation. */
#include "hyst/iir.h"
#include "random.h"
#include "unity.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static random_t rng;

void setUp(void) {
}
void tearDown(void) {
}

static hyst_q28_t q28(double x) {
    return (hyst_q28_t)lround(x * 0x1p28);
}

static hyst_iir_t accept(uint32_t sections, const hyst_iir_section_t section[]) {
    hyst_iir_t iir;
    uint32_t element;
    TEST_ASSERT_EQUAL_INT(HYST_IIR_OK, hyst_iir_build(&iir, sections, section, &element));
    return iir;
}

/* Stable section with poles at radius up to `radius` and zeros anywhere near, DC gain about 1. */
static hyst_iir_section_t random_section(double radius) {
    const double pole = radius * random_unit(&rng);
    const double pole_angle = 3.14159 * random_unit(&rng);
    const double zero = random_unit(&rng);
    const double zero_angle = 3.14159 * random_unit(&rng);
    const double a1 = -2.0 * pole * cos(pole_angle);
    const double a2 = pole * pole;
    const double b1 = -2.0 * zero * cos(zero_angle);
    const double b2 = zero * zero;
    const double gain = fmin((1.0 + a1 + a2) / (1.0 + b1 + b2), 2.0);
    return (hyst_iir_section_t){q28(gain), q28(gain * b1), q28(gain * b2), q28(a1), q28(a2)};
}

typedef struct {
    double x1, x2, y1, y2;
} direct_t;

static double direct_step(const hyst_iir_section_t *s, direct_t *d, double x) {
    const double y =
        (s->b0 * x + s->b1 * d->x1 + s->b2 * d->x2 - (double)s->a1 * d->y1 - (double)s->a2 * d->y2) * 0x1p-28;
    *d = (direct_t){x, d->x1, y, d->y1};
    return y;
}

/* Sum of the magnitudes of the impulse response of (n0 + n1 z^-1 + n2 z^-2) / A(z): the worst amplification of a
 * bounded input. */
static double worst_amplification(const hyst_iir_section_t *s, double n0, double n1, double n2) {
    const hyst_iir_section_t shape = {q28(n0), q28(n1), q28(n2), s->a1, s->a2};
    direct_t d = {0, 0, 0, 0};
    double sum = 0.0;
    for (int k = 0; k < 5000; k++) { /* 0.95^5000 is nothing */
        sum += fabs(direct_step(&shape, &d, k == 0 ? 1.0 : 0.0));
    }
    return sum;
}

static double signal_amplification(const hyst_iir_section_t *s) {
    return worst_amplification(s, s->b0 * 0x1p-28, s->b1 * 0x1p-28, s->b2 * 0x1p-28);
}

/* A section's own rounding: an error of at most 1 unit, shaped by (1 - z^-1) / A(z) through the error feedback. */
static double own_rounding(const hyst_iir_section_t *s) {
    return worst_amplification(s, 1.0, -1.0, 0.0);
}

/* The bound is derived, not measured: the first section's rounding through the second, plus the second's own, plus 1
 * for the reference. */
static void test_follows_double_precision(void) {
    double worst = 0.0; /* fraction of the bound */
    for (int run = 0; run < 300; run++) {
        const hyst_iir_section_t section[2] = {random_section(0.95), random_section(0.95)};
        const hyst_iir_t iir = accept(2, section);
        hyst_iir_state_t state;
        hyst_iir_reset(&state);
        const double bound =
            own_rounding(&section[0]) * signal_amplification(&section[1]) + own_rounding(&section[1]) + 1.0;
        direct_t direct[2] = {{0, 0, 0, 0}, {0, 0, 0, 0}};
        for (int k = 0; k < 2000; k++) {
            const int32_t x =
                random_q31(&rng) / 4096; /* so small that resonances cannot saturate: gain < 2 / (1 - 0.95)^2 = 800 */
            bool saturated = false;
            const int32_t y = hyst_iir_step(&iir, &state, x, &saturated);
            const double expected = direct_step(&section[1], &direct[1], direct_step(&section[0], &direct[0], x));
            if (saturated) {
                break; /* two resonances on top of each other */
            }
            worst = fmax(worst, fabs(y - expected) / bound);
        }
    }
    printf("two sections against double precision: worst difference is %.2f of the derived bound\n", worst);
    TEST_ASSERT_TRUE(worst <= 1.0);
}

/* Error feedback: a pole at 0.9999 with a tiny input settles to its exact gain; without it it would stick hundreds of
 * units away. */
static void test_settles_to_the_exact_gain(void) {
    const hyst_iir_section_t lag = {q28(0.0001), 0, 0, q28(-0.9999), 0};
    const hyst_iir_t iir = accept(1, &lag);
    const double gain = (double)lag.b0 / ((double)HYST_Q28_ONE + lag.a1);
    for (int run = 0; run < 20; run++) {
        const int32_t x = random_between(&rng, -2000, 2000);
        hyst_iir_state_t state;
        hyst_iir_reset(&state);
        bool saturated = false;
        int32_t y = 0;
        for (int k = 0; k < 400000; k++) {
            y = hyst_iir_step(&iir, &state, x, &saturated);
        }
        TEST_ASSERT_TRUE(fabs(y - gain * x) <= 1.0);
    }
}

static void test_settle_is_the_fixed_point(void) {
    for (int run = 0; run < 500; run++) {
        const hyst_iir_section_t section[3] = {random_section(0.9), random_section(0.9), random_section(0.9)};
        const hyst_iir_t iir = accept(3, section);
        const int32_t x = random_q31(&rng) / 2;
        hyst_iir_state_t state;
        hyst_iir_settle(&iir, &state, x);
        const int32_t settled = state.section[2].y1;
        /* A settled output is truncated: 1 unit off in y1 and y2, an impulse of at most |a1| + 2 |a2| <= 4 through 1 /
         * A; and it rounds on. */
        double bound = 0.0;
        for (int i = 0; i < 3; i++) {
            bound = bound * signal_amplification(&section[i]) + 4.0 * worst_amplification(&section[i], 1.0, 0.0, 0.0) +
                    own_rounding(&section[i]);
        }
        bool saturated = false;
        for (int k = 0; k < 100; k++) {
            const int32_t y = hyst_iir_step(&iir, &state, x, &saturated);
            if (settled < INT32_MAX && settled > INT32_MIN) {
                TEST_ASSERT_TRUE((double)llabs((int64_t)y - settled) <= bound);
            }
        }
    }
}

static void test_saturates_and_reports(void) {
    const hyst_iir_section_t gain = {q28(4.0), 0, 0, 0, 0};
    const hyst_iir_t iir = accept(1, &gain);
    hyst_iir_state_t state;
    hyst_iir_reset(&state);
    bool saturated = false;
    TEST_ASSERT_EQUAL_INT32(4 * 1000, hyst_iir_step(&iir, &state, 1000, &saturated));
    TEST_ASSERT_FALSE(saturated);
    TEST_ASSERT_EQUAL_INT32(INT32_MAX, hyst_iir_step(&iir, &state, INT32_MAX / 2, &saturated));
    TEST_ASSERT_TRUE(saturated);
    TEST_ASSERT_EQUAL_INT32(INT32_MIN, hyst_iir_step(&iir, &state, INT32_MIN, &saturated));
}

/* The largest accepted coefficients with the worst signs of signals: the 64-bit sum must not wrap (UBSan would see it
 * too). */
static void test_the_largest_sum_does_not_wrap(void) {
    const hyst_iir_section_t s = {INT32_MAX - 16, q28(4.0), q28(1.0), q28(-1.0), q28(0.5)};
    const hyst_iir_t iir = accept(1, &s);
    hyst_iir_state_t state = {.x1 = INT32_MAX, .x2 = INT32_MAX};
    state.section[0] = (hyst_iir_section_state_t){INT32_MAX, INT32_MIN, HYST_Q28_ONE - 1};
    bool saturated = false;
    TEST_ASSERT_EQUAL_INT32(INT32_MAX, hyst_iir_step(&iir, &state, INT32_MAX, &saturated));
    TEST_ASSERT_TRUE(saturated);
}

static void test_no_sections_is_a_wire(void) {
    const hyst_iir_t iir = accept(0, NULL);
    hyst_iir_state_t state;
    hyst_iir_settle(&iir, &state, 5);
    bool saturated = false;
    TEST_ASSERT_EQUAL_INT32(INT32_MIN, hyst_iir_step(&iir, &state, INT32_MIN, &saturated));
    TEST_ASSERT_FALSE(saturated);
}

/* A first sample is a sample after settling, to the last bit of the state: sections of any gain, saturated or not. */
static void test_a_first_sample_is_settling_and_a_sample(void) {
    int saturations = 0;
    for (int run = 0; run < 20000; run++) {
        hyst_iir_section_t section[HYST_IIR_MAX_SECTIONS];
        const uint32_t sections = (uint32_t)(random_bits(&rng) % (HYST_IIR_MAX_SECTIONS + 1U));
        for (uint32_t i = 0; i < HYST_IIR_MAX_SECTIONS; i++) {
            section[i] = random_section(0.999);
            if (random_unit(&rng) < 0.3) { /* gains up to 4 */
                section[i].b0 = random_q31(&rng) / 2;
            }
        }
        const hyst_iir_t iir = accept(sections, section);
        hyst_iir_state_t expected, got;
        hyst_iir_reset(&expected);
        got = expected;
        const hyst_q31_t x = random_unit(&rng) < 0.1 ? INT32_MIN : random_q31(&rng) >> (random_bits(&rng) % 31U);
        bool wanted = false;
        bool saturated = false;
        hyst_iir_settle(&iir, &expected, x);
        TEST_ASSERT_EQUAL_INT32(hyst_iir_step(&iir, &expected, x, &wanted), hyst_iir_begin(&iir, &got, x, &saturated));
        TEST_ASSERT_EQUAL_INT(wanted, saturated);
        TEST_ASSERT_EQUAL_MEMORY(&expected, &got, sizeof got);
        saturations += saturated ? 1 : 0;
    }
    TEST_ASSERT_TRUE(saturations > 500);
}

static void refused(hyst_iir_section_t bad, hyst_iir_status_t status) {
    const hyst_iir_section_t good = {HYST_Q28_ONE, 0, 0, 0, 0};
    const hyst_iir_section_t section[2] = {good, bad};
    hyst_iir_t iir;
    uint32_t element = 9;
    TEST_ASSERT_EQUAL_INT(status, hyst_iir_build(&iir, 2, section, &element));
    TEST_ASSERT_EQUAL_UINT32(1, element);
}

static void test_refuses_unstable_and_too_large(void) {
    const hyst_q28_t one = HYST_Q28_ONE;
    refused((hyst_iir_section_t){one, 0, 0, 0, one}, HYST_IIR_UNSTABLE);
    refused((hyst_iir_section_t){one, 0, 0, 0, -one}, HYST_IIR_UNSTABLE);
    refused((hyst_iir_section_t){one, 0, 0, one, 0}, HYST_IIR_UNSTABLE);
    refused((hyst_iir_section_t){one, 0, 0, -one, 0}, HYST_IIR_UNSTABLE);
    refused((hyst_iir_section_t){one, 0, 0, -one - one / 2, one / 2}, HYST_IIR_UNSTABLE);
    refused((hyst_iir_section_t){INT32_MIN, INT32_MAX, 0, 0, 0}, HYST_IIR_COEFFICIENTS_TOO_LARGE);
    const hyst_iir_section_t many[HYST_IIR_MAX_SECTIONS + 1] = {{.b0 = 0}};
    hyst_iir_t iir;
    uint32_t element;
    TEST_ASSERT_EQUAL_INT(HYST_IIR_TOO_MANY_SECTIONS, hyst_iir_build(&iir, HYST_IIR_MAX_SECTIONS + 1, many, &element));
}

int main(void) {
    rng = random_start("test_iir", 20261121);
    UNITY_BEGIN();
    RUN_TEST(test_a_first_sample_is_settling_and_a_sample);
    RUN_TEST(test_follows_double_precision);
    RUN_TEST(test_settles_to_the_exact_gain);
    RUN_TEST(test_settle_is_the_fixed_point);
    RUN_TEST(test_saturates_and_reports);
    RUN_TEST(test_the_largest_sum_does_not_wrap);
    RUN_TEST(test_no_sections_is_a_wire);
    RUN_TEST(test_refuses_unstable_and_too_large);
    return UNITY_END();
}
