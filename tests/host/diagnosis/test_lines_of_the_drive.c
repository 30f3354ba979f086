/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A line at a frequency of the drive is what a hysteresis of another shape leaves, unless it is there at rest, too. */
#include "diagnosis/judgement/no_physics.h"
#include "support.h"
#include "unity.h"
#include <gsl/gsl_math.h>

enum { SAMPLES = 8000, REST = 2000 };
static const double rate_hz = 2000.0, tone_hz[] = {5.0, 23.0, 71.0}, hum_um = 0.02, noise_um = 0.005;
static random_t rng;
static recording_t recording;
static failure_t failure;

/* Three tones that repeat themselves each second; it rests in the end, or not. */
static void fill_drive(size_t rest) {
    for (size_t k = 0; k < SAMPLES; k++) {
        const double t = (double)(k < SAMPLES - rest ? k : SAMPLES - rest) / rate_hz;
        double sum = 50.0;
        for (size_t i = 0; i < 3; i++) {
            sum += 15.0 * sin(2.0 * M_PI * tone_hz[i] * t + (double)i);
        }
        recording.column[COLUMN_DRIVE][k] = sum;
    }
}

void setUp(void) {
    recording_create(&recording, "tones.csv", rate_hz, SAMPLES);
}

void tearDown(void) {
    recording_free(&recording);
}

/* Whether hum of this frequency and amplitude is taken for none; the readings have such a line, of `there_um`. */
static bool is_none(double hz, double there_um) {
    model_t model;
    samples_t samples;
    make_fine_bank_model(&model, rate_hz, 8);
    model_block_t *hum = model_append(&model, catalogue_find("mains_interference"));
    model_set(hum, "frequency_hz", hz);
    model_set(hum, "amplitude_um", hum_um);
    simulate_into(&recording, &model, 1);
    for (size_t k = 0; k < SAMPLES; k++) {
        recording.column[COLUMN_DISPLACEMENT][k] = 0.1 * recording.column[COLUMN_DRIVE][k] +
                                                   there_um * sin(2.0 * M_PI * hz * (double)k / rate_hz) +
                                                   noise_um * random_normal(&rng);
    }
    TEST_ASSERT_TRUE_MESSAGE(samples_open(&samples, &model, &recording, 1, &failure), failure.text);
    const bool none = no_physics(&samples, hum);
    samples_close(&samples);
    model_free(&model);
    return none;
}

/* However seldom the drive repeats itself: four times here, and not at all with a tone more. */
static void test_a_line_of_the_drive_is_none(void) {
    fill_drive(0);
    for (size_t i = 0; i < 3; i++) {
        TEST_ASSERT_TRUE(is_none(tone_hz[i] + 0.009, hum_um));
    }
    for (size_t k = 0; k < SAMPLES; k++) {
        recording.column[COLUMN_DRIVE][k] += 15.0 * sin(2.0 * M_PI * M_PI * (double)k / rate_hz);
    }
    for (size_t i = 0; i < 3; i++) {
        TEST_ASSERT_TRUE(is_none(tone_hz[i] + 0.009, hum_um));
    }
    TEST_ASSERT_FALSE(is_none(50.0, hum_um));
}

/* A rest of a second tells. */
static void test_what_is_there_at_rest_is_hum(void) {
    fill_drive(REST);
    TEST_ASSERT_TRUE(is_none(71.009, 0.0));
    TEST_ASSERT_FALSE(is_none(71.009, hum_um));
}

/* A drive without lines may have hum at any frequency: a sweep, noise. */
static void test_a_drive_without_lines(void) {
    double level = 50.0;
    for (size_t k = 0; k < SAMPLES; k++) {
        const double t = (double)k / rate_hz;
        recording.column[COLUMN_DRIVE][k] = 50.0 + 40.0 * sin(2.0 * M_PI * (2.0 + 12.0 * t) * t);
    }
    TEST_ASSERT_FALSE(is_none(50.0, hum_um));
    for (size_t k = 0; k < SAMPLES; k++) {
        level = fmin(fmax(level + 2.0 * random_normal(&rng), 0.0), 100.0);
        recording.column[COLUMN_DRIVE][k] = level;
    }
    for (size_t i = 0; i < 19; i++) {
        TEST_ASSERT_FALSE(is_none(20.0 + 9.7 * (double)i, hum_um));
    }
}

int main(void) {
    rng = random_start("lines_of_the_drive", 20261128);
    UNITY_BEGIN();
    RUN_TEST(test_a_line_of_the_drive_is_none);
    RUN_TEST(test_what_is_there_at_rest_is_hum);
    RUN_TEST(test_a_drive_without_lines);
    return UNITY_END();
}
