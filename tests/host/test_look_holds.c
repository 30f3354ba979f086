/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What rings, settles and creeps where the drive holds. */
#include "one_look.h"
#include "unity.h"
#include <gsl/gsl_math.h>
#include <stdio.h>

/* What rings: 212.7 Hz seen, damping 0.013, on a slow creep and noise. */
static void test_frequency_and_damping_of_a_ring(void) {
    const double f = 212.7, damping = 0.013, alpha = 2.0 * M_PI * f * damping / sqrt(1.0 - damping * damping);
    for (size_t trial = 0; trial < (INSTRUMENTED ? 1 : 5); trial++) {
        for (size_t k = 0; k < SAMPLES; k++) {
            const double t = ((double)k - 3000.0) / rate_hz;
            drive()[k] = k >= 3000 ? 60.0 : 10.0;
            position()[k] = 0.1 * drive()[k] + 0.004 * random_normal(&rng);
            if (k >= 3000) {
                position()[k] += -4.0 * exp(-alpha * t) * cos(2.0 * M_PI * f * t) + 0.05 * log10(0.01 + t);
            }
        }
        see();
        TEST_ASSERT_EQUAL(1, look.ring.rings);
        TEST_ASSERT_DOUBLE_WITHIN(errors * look.ring.frequency_sigma_hz, f, look.ring.frequency_hz);
        TEST_ASSERT_DOUBLE_WITHIN(errors * look.ring.damping_sigma, damping, look.ring.damping);
        /* Of such a decay an error of 1e-4 is possible; a hundred times as much would be no answer. */
        TEST_ASSERT_TRUE(look.ring.frequency_sigma_hz < 0.01 * f && look.ring.damping_sigma < 0.1 * damping);
        look_free(&look);
    }
}

static void test_a_step_without_a_ring(void) {
    for (size_t k = 0; k < SAMPLES; k++) {
        drive()[k] = k >= 3000 ? 60.0 : 10.0;
        position()[k] = 0.1 * drive()[k] + 0.004 * random_normal(&rng);
        position()[k] += k >= 3000 ? -2.0 * exp(-((double)k - 3000.0) / 40.0) : 0.0;
    }
    see();
    TEST_ASSERT_EQUAL(0, look.ring.rings);
    look_free(&look);
}

/* 1.3 % of the way per decade, in both directions. */
static void test_creep_in_holds(void) {
    const double creep = 0.013;
    for (size_t trial = 0; trial < 5; trial++) {
        double level = 10.0, offset = 0.0;
        size_t since = 0;
        for (size_t k = 0; k < SAMPLES; k++) {
            const double next = k / 4096 % 2 == 1 ? 70.0 : 10.0;
            if (next != level) { /* what crept stays, so that each hold has its own slope */
                offset += 0.1 * (next - level);
                level = next;
                since = k;
            }
            drive()[k] = level;
            position()[k] = offset + 0.002 * random_normal(&rng);
            if (since > 0 && k > since) {
                position()[k] +=
                    creep * 0.1 * (level == 70.0 ? 60.0 : -60.0) * log10((double)(k - since) / rate_hz / 0.1);
            }
        }
        see();
        TEST_ASSERT_EQUAL(3, look.holds.count);
        TEST_ASSERT_TRUE(look.holds.creep_sigma > 0.0 && look.holds.creep_sigma < 0.1 * creep);
        /* The change before a hold has the creep of the first two samples in it: three decades below 0.1 s, 4 %. */
        TEST_ASSERT_DOUBLE_WITHIN(errors * look.holds.creep_sigma + 0.06 * creep, creep, look.holds.creep);
        look_free(&look);
    }
}

/* Holds of 0.1 s behind a low pass, from shorter to longer than they are: no creep is in them. It was 115 % of the way
 * per decade at 60 Hz, and -181 % at 8. */
static void test_a_low_pass_is_no_creep(void) {
    static const double pass_hz[] = {60.0, 25.0, 8.0, 3.0, 1.0};
    for (size_t i = 0; i < sizeof pass_hz / sizeof *pass_hz; i++) {
        const double keep = exp(-2.0 * M_PI * pass_hz[i] / rate_hz);
        double y = 5.0;
        fill_levels(200);
        for (size_t k = 0; k < SAMPLES; k++) {
            position()[k] = y + 0.005 * random_normal(&rng);
            y = keep * y + (1.0 - keep) * 0.1 * drive()[k];
        }
        see();
        char text[100];
        snprintf(text, sizeof text, "%g Hz: %g +- %g a decade", pass_hz[i], look.holds.creep, look.holds.creep_sigma);
        /* Nothing, or nothing but what the last of an exponential is behind 12 time constants: 0.02 %. */
        TEST_ASSERT_TRUE_MESSAGE(
            look.holds.creep_sigma <= 0.0 || fabs(look.holds.creep) < 2e-4 + errors * look.holds.creep_sigma, text);
        look_free(&look);
    }
}

/* A step of 180 Hz with damping 0.02, and a creep of 1.2 % a decade below it, in holds of 0.5 s. The line that is laid
 * through it begins one sample after the step: 2.7 decades of creep are 3 % of the way. */
static void test_creep_beside_a_ring(void) {
    const double creep = 0.012, f = 180.0, alpha = 0.02 * 2.0 * M_PI * f;
    double level = 10.0, offset = 1.0;
    for (size_t k = 0; k < SAMPLES; k++) {
        const size_t since = k % 1000;
        if (since == 0 && k > 0) {
            const double next = 10.0 + 80.0 * random_unit(&rng);
            offset += 0.1 * (next - level) * (1.0 + creep * log10(1000.0));
            level = next;
        }
        drive()[k] = level;
        position()[k] = offset + 0.003 * random_normal(&rng);
        if (k >= 1000) {
            const double t = (double)since / rate_hz, way = 0.1 * (level - drive()[k - since - 1]);
            position()[k] +=
                way * (creep * log10(((double)since + 0.01) / 1000.0) - exp(-alpha * t) * cos(2.0 * M_PI * f * t));
        }
    }
    see();
    TEST_ASSERT_TRUE(look.holds.creep_sigma > 0.0 && look.holds.creep_sigma < 0.1 * creep);
    TEST_ASSERT_DOUBLE_WITHIN(errors * look.holds.creep_sigma + 0.05 * creep, creep, look.holds.creep);
    look_free(&look);
}

int main(void) {
    rng = random_start("look_holds", 20260717U);
    UNITY_BEGIN();
    RUN_TEST(test_frequency_and_damping_of_a_ring);
    RUN_TEST(test_a_step_without_a_ring);
    RUN_TEST(test_creep_in_holds);
    RUN_TEST(test_a_low_pass_is_no_creep);
    RUN_TEST(test_creep_beside_a_ring);
    return UNITY_END();
}
