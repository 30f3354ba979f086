/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Rails are seen where they are, whatever the hysteresis is, and none where the drive stays between them. */
#include "look/rails.h"
#include "support.h"
#include "unity.h"
#include <gsl/gsl_math.h>
#include <math.h>
#include <stdio.h>

enum { SAMPLES = 8000, PLAYS = 200 };
static const double rate_hz = 4000.0;
static recording_t recording;
static model_t bank;
static random_t rng;

void setUp(void) {
    rng = random_start("look_rails", 20261129);
    recording_create(&recording, "rails.csv", rate_hz, SAMPLES);
    make_fine_bank_model(&bank, rate_hz, PLAYS);
}

void tearDown(void) {
    model_free(&bank);
    recording_free(&recording);
}

/* 2 to 98 V: two loops, then ever smaller ones. */
static void fill_decay(void) {
    for (size_t k = 0; k < SAMPLES; k++) {
        const double t = (double)k / rate_hz, height_v = t < 1.0 ? 48.0 : 48.0 * (2.0 - t);
        recording.column[COLUMN_DRIVE][k] = 50.0 - height_v * cos(2.0 * M_PI * 2.0 * t);
    }
}

static rails_t seen(double low_v, double high_v, double noise_um) {
    rails_t rails;
    measure_with(&recording, &bank, &block_amplifier_saturation, (double[]){low_v, high_v}, noise_um, &rng);
    rails_look(&recording, noise_um, &rails);
    printf("rails at %g and %g V, seen: %d at %g, %d at %g V\n", low_v, high_v, (int)rails.low, rails.low_v,
           (int)rails.high, rails.high_v);
    return rails;
}

/* The way into a rail is bent, for the plays let go one after the other, and the line that is laid over 6 V of it is
 * not: that is less than 0.1 V. */
static void expect_both(double low_v, double high_v, double noise_um) {
    const rails_t rails = seen(low_v, high_v, noise_um);
    TEST_ASSERT_TRUE(rails.low && rails.high);
    TEST_ASSERT_DOUBLE_WITHIN(0.2, low_v, rails.low_v);
    TEST_ASSERT_DOUBLE_WITHIN(0.2, high_v, rails.high_v);
}

static void test_rails_are_seen_where_they_are(void) {
    fill_decay();
    expect_both(6.0, 93.0, 0.004);
    expect_both(20.0, 70.0, 0.004);
    expect_both(10.0, 90.0, 0.02);
}

static void test_one_rail_is_seen(void) {
    fill_decay();
    const rails_t rails = seen(-100.0, 85.0, 0.01);
    TEST_ASSERT_FALSE(rails.low);
    TEST_ASSERT_TRUE(rails.high);
}

static void test_a_drive_between_the_rails_shows_none(void) {
    for (int tones = 0; tones < 2; tones++) {
        if (tones == 0) {
            fill_decay();
        } else {
            fill_tones(recording.column[COLUMN_DRIVE], SAMPLES, rate_hz, 50.0, &rng);
        }
        const rails_t rails = seen(-100.0, 200.0, 0.004);
        TEST_ASSERT_FALSE(rails.low || rails.high);
    }
}

/* Of an excursion that the noise hides nothing is said: beyond the rail the drive goes by 1 V. */
static void test_noise_hides_a_rail(void) {
    fill_decay();
    const rails_t rails = seen(-100.0, 97.0, 0.1);
    TEST_ASSERT_FALSE(rails.low || rails.high);
}

/* A drive that rests, and one that never moves. */
static void test_rests_are_no_rails(void) {
    for (int moves = 0; moves < 2; moves++) {
        for (size_t k = 0; k < SAMPLES; k++) {
            recording.column[COLUMN_DRIVE][k] = moves != 0 && k % 2000 > 1000 ? 98.0 : 2.0;
        }
        const rails_t rails = seen(-100.0, 200.0, 0.004);
        TEST_ASSERT_FALSE(rails.low || rails.high);
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_rails_are_seen_where_they_are);
    RUN_TEST(test_one_rail_is_seen);
    RUN_TEST(test_a_drive_between_the_rails_shows_none);
    RUN_TEST(test_noise_hides_a_rail);
    RUN_TEST(test_rests_are_no_rails);
    return UNITY_END();
}
