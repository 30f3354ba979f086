/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The error budget finds the flaws that were put in. */
#include "random.h"
#include "report/error_budget.h"
#include <math.h>
#include <stdio.h>
#include <unity.h>

#define SAMPLES 8192
#define RATE_HZ 10000.0

static double reference[SAMPLES], position[SAMPLES];
static random_t generator;

void setUp(void) {
}

void tearDown(void) {
}

static double wave(double t) {
    return 20.0 * sin(6.283185307179586 * 10.0 * t) + 5.0;
}

static double rms_error(void) {
    double sum = 0.0;
    for (size_t k = 0; k < SAMPLES; k++) {
        sum += (position[k] - reference[k]) * (position[k] - reference[k]);
    }
    return sqrt(sum / SAMPLES);
}

static void check_squares(const error_budget_t *budget) {
    const double squares = budget->static_um * budget->static_um + budget->delay_um * budget->delay_um +
                           budget->noise_um * budget->noise_um + budget->rest_um * budget->rest_um;
    /* Two regressions in double precision lie between the two sides. */
    TEST_ASSERT_DOUBLE_WITHIN(1e-9 * rms_error() + 1e-12, rms_error(), sqrt(squares));
}

static void test_delay_gain_and_noise_are_told_apart(void) {
    const double delay_s = 37e-6, gain = 1.004, offset_um = 0.05, noise_um = 0.02;
    for (size_t k = 0; k < SAMPLES; k++) {
        const double t = (double)k / RATE_HZ;
        reference[k] = wave(t);
        position[k] = offset_um + gain * wave(t - delay_s) + noise_um * random_normal(&generator);
    }
    const error_budget_t budget = error_budget(reference, position, SAMPLES, RATE_HZ);
    check_squares(&budget);
    /* The rate of the sine has RMS 889 um/s: one sigma of the delay is 0.02 / 889 / sqrt(8192) = 0.25 us. Six of them,
     * and the gain scales the delay by 0.4 %. */
    TEST_ASSERT_DOUBLE_WITHIN(1.5e-6 + 0.004 * delay_s, delay_s, budget.delay_s);
    TEST_ASSERT_DOUBLE_WITHIN((1.5e-6 + 0.004 * delay_s) * 888.6, delay_s * 888.6,
                              budget.delay_um); /* the same, as a position */
    /* offset and gain: 0.05 + 0.004 * reference; RMS of the reference about its mean 14.14, mean 5. One sigma of each
     * is 0.02 / sqrt(8192). */
    TEST_ASSERT_DOUBLE_WITHIN(6.0 * 0.02 / 90.5, hypot(0.05 + 0.004 * 5.0, 0.004 * 14.142), budget.static_um);
    /* A median of 8189 correlated third differences: about 2 % standard error; six of them. */
    TEST_ASSERT_DOUBLE_WITHIN(0.12 * noise_um, noise_um, budget.noise_um);
}

static void test_hysteresis_is_the_rest(void) {
    for (size_t k = 0; k < SAMPLES; k++) {
        const double t = (double)k / RATE_HZ;
        reference[k] = wave(t);
        /* A third harmonic is neither gain nor delay of a sine. */
        position[k] = reference[k] + 0.3 * sin(6.283185307179586 * 30.0 * t);
    }
    const error_budget_t budget = error_budget(reference, position, SAMPLES, RATE_HZ);
    check_squares(&budget);
    /* The record is not a whole number of periods (8.19): the harmonics are orthogonal to about 1 / (2 pi 8) of them.
     */
    TEST_ASSERT_DOUBLE_WITHIN(0.02 * 0.2121, 0.2121, budget.rest_um);
    TEST_ASSERT_DOUBLE_WITHIN(0.02 * 0.2121, 0.0, budget.noise_um);
}

static void test_perfect_track_has_no_parts(void) {
    for (size_t k = 0; k < SAMPLES; k++) {
        reference[k] = k < SAMPLES / 2 ? 1.0 : 2.0;
        position[k] = reference[k];
    }
    const error_budget_t budget = error_budget(reference, position, SAMPLES, RATE_HZ);
    TEST_ASSERT_DOUBLE_WITHIN(0.0, 0.0, budget.static_um + budget.delay_um + budget.noise_um + budget.rest_um);
}

static void test_short_and_resting_tracks_are_finite(void) {
    for (size_t k = 0; k < 8; k++) {
        reference[k] = 3.0; /* a reference at rest: its gain and rate columns carry nothing */
        position[k] = 3.5;
    }
    const error_budget_t budget = error_budget(reference, position, 8, RATE_HZ);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.5, budget.static_um);
    TEST_ASSERT_TRUE(isfinite(budget.delay_s) && isfinite(budget.noise_um) && isfinite(budget.rest_um));
}

int main(void) {
    generator = random_start("test_error_budget", 20261121);
    UNITY_BEGIN();
    RUN_TEST(test_delay_gain_and_noise_are_told_apart);
    RUN_TEST(test_hysteresis_is_the_rest);
    RUN_TEST(test_perfect_track_has_no_parts);
    RUN_TEST(test_short_and_resting_tracks_are_finite);
    return UNITY_END();
}
