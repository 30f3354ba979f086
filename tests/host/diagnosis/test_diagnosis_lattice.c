/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The steps of a converter, seen in the readings alone. */
#include "diagnosis/noise/lattice.h"
#include "support.h"
#include "unity.h"
#include <math.h>
#include <stdlib.h>

enum { SAMPLES = 4000, RECORDINGS = 2 };
static const double amplitude_um = 4.0;
static random_t rng;
static recording_t recordings[RECORDINGS];
static double sigma_um;

void setUp(void) {
    for (size_t i = 0; i < RECORDINGS; i++) {
        recording_create(&recordings[i], "readings.csv", 2000.0, SAMPLES);
    }
    sigma_um = -1.0;
}

void tearDown(void) {
    for (size_t i = 0; i < RECORDINGS; i++) {
        recording_free(&recordings[i]);
    }
}

/* A sine with noise, read in steps that do not begin at 0; step 0: not in steps. digits: what the file keeps behind the
 * point. */
static void fill(recording_t *recording, double step_um, double noise_um, int digits) {
    const double unit = pow(10.0, digits);
    for (size_t k = 0; k < SAMPLES; k++) {
        double x = 3.3 + amplitude_um * sin(0.01 * (double)k) + noise_um * random_normal(&rng);
        x = step_um > 0.0 ? 0.0123 + step_um * round((x - 0.0123) / step_um) : x;
        recording->column[COLUMN_DISPLACEMENT][k] = round(x * unit) / unit;
    }
}

static double step_of_one(void) {
    return lattice_step_um(recordings, 1, &sigma_um);
}

/* With 15 digits the step is known to rounding; with d digits each level is wrong by up to half of the last one, about
 * evenly, so 0.29 10^-d each. Five of the standard errors that a straight line through n evenly spaced levels has:
 * deviation sqrt(12) / n^1.5. */
static void test_a_step_is_found(void) {
    const struct {
        double step_um, noise_um;
        int digits;
    } cases[] = {
        {0.02, 0.0, 12}, {0.0123, 0.005, 12}, {0.0200033, 0.03, 6}, {0.012370711, 0.005, 6}, {0.0457391, 0.1, 4}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        fill(&recordings[0], cases[i].step_um, cases[i].noise_um, cases[i].digits);
        const double levels = 2.0 * amplitude_um / cases[i].step_um;
        const double deviation = 0.29 * pow(10.0, -cases[i].digits) * sqrt(12.0) / pow(levels, 1.5);
        TEST_ASSERT_DOUBLE_WITHIN(5.0 * deviation + 1e-12, cases[i].step_um, step_of_one());
        /* What it says of its own error is that, within a factor of 3 (the levels' errors are not quite independent).
         */
        TEST_ASSERT_TRUE(sigma_um >= 0.0 && sigma_um < 3.0 * deviation + 1e-12);
        TEST_ASSERT_TRUE(cases[i].digits > 6 || sigma_um > deviation / 3.0);
    }
}

/* A drive that runs fast over the middle leaves levels out there, in runs of up to four; most neighbours are still one
 * apart. */
static void test_levels_may_be_skipped(void) {
    const double step_um = 0.02;
    for (size_t k = 0; k < SAMPLES; k++) {
        long level = (long)(random_bits(&rng) % 400);
        level -= level > 100 && level < 300 ? level % 5 : 0; /* between 100 and 300 only each fifth */
        recordings[0].column[COLUMN_DISPLACEMENT][k] = step_um * (double)level;
    }
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, step_um, step_of_one());
}

static void test_noise_is_not_in_steps(void) {
    fill(&recordings[0], 0.0, 0.01, 15);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, step_of_one());
    fill(&recordings[0], 0.0, 0.0, 15);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, step_of_one());
}

/* Readings that repeat, at levels that are not evenly spaced. */
static void test_uneven_levels_are_no_steps(void) {
    double level[100] = {0};
    for (int i = 1; i < 100; i++) {
        level[i] = level[i - 1] + 0.01 * (0.5 + random_unit(&rng));
    }
    for (size_t k = 0; k < SAMPLES; k++) {
        recordings[0].column[COLUMN_DISPLACEMENT][k] = level[random_bits(&rng) % 100];
    }
    TEST_ASSERT_EQUAL_DOUBLE(0.0, step_of_one());
}

/* Few levels are evenly spaced by chance. */
static void test_a_constant_and_a_switch_are_no_steps(void) {
    TEST_ASSERT_EQUAL_DOUBLE(0.0, step_of_one());
    for (size_t k = 0; k < SAMPLES; k++) {
        recordings[0].column[COLUMN_DISPLACEMENT][k] = k % 2 == 0 ? 1.0 : 2.0;
    }
    TEST_ASSERT_EQUAL_DOUBLE(0.0, step_of_one());
}

/* A line in place of wrong readings is between the steps. */
static void test_what_is_masked_was_not_read(void) {
    fill(&recordings[0], 0.02, 0.01, 12);
    recordings[0].column[COLUMN_DISPLACEMENT][50] += 3.0;
    recording_mask(&recordings[0], 50, 51);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.02, step_of_one());
}

static void test_recordings_have_to_agree(void) {
    fill(&recordings[0], 0.02, 0.01, 12);
    fill(&recordings[1], 0.02, 0.05, 12);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.02, lattice_step_um(recordings, 2, &sigma_um));
    TEST_ASSERT_TRUE(sigma_um >= 0.0 && sigma_um < 1e-9);
    fill(&recordings[1], 0.03, 0.01, 12);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, lattice_step_um(recordings, 2, &sigma_um));
    fill(&recordings[1], 0.0, 0.01, 12);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, lattice_step_um(recordings, 2, &sigma_um));
}

/* Within a tenth of a step to either side lies a fifth of all there is. */
static void test_likelihood_of_a_reading(void) {
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 2.0 * log(5.0), lattice_likelihood_per_sample());
}

int main(void) {
    rng = random_start("diagnosis_lattice", 20261121);
    UNITY_BEGIN();
    RUN_TEST(test_a_step_is_found);
    RUN_TEST(test_levels_may_be_skipped);
    RUN_TEST(test_noise_is_not_in_steps);
    RUN_TEST(test_uneven_levels_are_no_steps);
    RUN_TEST(test_a_constant_and_a_switch_are_no_steps);
    RUN_TEST(test_what_is_masked_was_not_read);
    RUN_TEST(test_recordings_have_to_agree);
    RUN_TEST(test_likelihood_of_a_reading);
    return UNITY_END();
}
