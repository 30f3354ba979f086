/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Hum in recordings that were begun at any moment: one line, one amplitude, and each recording its own phase. */
#include "diagnosis/diagnose.h"
#include "diagnosis/noise/line_clock.h"
#include "support.h"
#include "unity.h"
#include <gsl/gsl_math.h>
#include <math.h>
#include <stdlib.h>

enum { RECORDINGS = 3, REST = 1500 };
static const size_t lengths[RECORDINGS] = {9000, 14000, 7000};
static const double rate_hz = 2000.0, noise_um = 0.005, hum_hz = 49.97, hum_um = 0.02;
static random_t rng;
static recording_t recordings[RECORDINGS];
static model_t model;
static double begun_s[RECORDINGS]; /* on the clock of the mains, a part of a period */
static failure_t failure;

/* The range once, loops, and a rest; recordings of three lengths and speeds. */
void setUp(void) {
    static const double weights[] = {0.09, 0.006, 0.004, 0.003}, thresholds[] = {5.0, 15.0, 30.0};
    static const double corner[] = {0.0, 100.0, 0.0, 80.0, 20.0, 60.0, 40.0};
    make_bank_model(&model, rate_hz, 1.0, 3, weights, thresholds);
    for (size_t i = 0; i < RECORDINGS; i++) {
        recording_create(&recordings[i], "hum.csv", rate_hz, lengths[i]);
        double *drive = recordings[i].column[COLUMN_DRIVE];
        fill_lines(drive, lengths[i], corner, 7, 700 - 150 * i);
        for (size_t k = lengths[i] - REST; k < lengths[i]; k++) {
            drive[k] = drive[lengths[i] - REST - 1];
        }
        simulate_into(&recordings[i], &model, 1);
        begun_s[i] = random_unit(&rng) / hum_hz;
        for (size_t k = 0; k < lengths[i]; k++) {
            recordings[i].column[COLUMN_DISPLACEMENT][k] +=
                noise_um * random_normal(&rng) + hum_um * sin(2.0 * M_PI * hum_hz * ((double)k / rate_hz + begun_s[i]));
        }
    }
}

void tearDown(void) {
    model_free(&model);
    for (size_t i = 0; i < RECORDINGS; i++) {
        recording_free(&recordings[i]);
    }
}

/* From one clock to another, the short way round a period. */
static double apart_s(double one_s, double other_s) {
    return remainder(one_s - other_s, 1.0 / hum_hz);
}

/* By a line that is given 0.03 Hz off, a third of a bin of the longest recording: over half of that it is 0.7 rad. The
 * phase of a line of four times the noise in 4000 samples is known to sqrt(2 / 4000) / 4 = 0.006 rad. Where samples are
 * held out, the larger noise of second differences at high frequencies leaks in: 0.04 rad were seen. */
static void test_clocks_are_found(void) {
    static const double line_hz[] = {333.0, 50.0}, most_rad = 0.12;
    samples_t samples;
    TEST_ASSERT_TRUE_MESSAGE(samples_open(&samples, &model, recordings, RECORDINGS, &failure), failure.text);
    double *simulated = samples_column(&samples), *residual = samples_column(&samples);
    TEST_ASSERT_TRUE_MESSAGE(samples_simulate(&samples, &model, simulated, &failure), failure.text);
    samples_residual(&samples, simulated, residual);
    line_clock_set(recordings, &samples, residual, line_hz, 2);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, recordings[0].clock_s);
    for (size_t i = 1; i < RECORDINGS; i++) {
        const double off_s = apart_s(recordings[i].clock_s, begun_s[i] - begun_s[0]);
        printf("recording %zu: off by %.4f rad\n", i, 2.0 * M_PI * hum_hz * off_s);
        TEST_ASSERT_TRUE(recordings[i].clock_s >= 0.0 && recordings[i].clock_s <= 1.0 / hum_hz);
        TEST_ASSERT_DOUBLE_WITHIN(most_rad / (2.0 * M_PI * hum_hz), 0.0, off_s);
    }
    free(simulated);
    free(residual);
    samples_close(&samples);
}

static void test_without_lines_no_clock_is_set(void) {
    samples_t samples;
    TEST_ASSERT_TRUE_MESSAGE(samples_open(&samples, &model, recordings, RECORDINGS, &failure), failure.text);
    double *residual = samples_column(&samples);
    line_clock_set(recordings, &samples, residual, NULL, 0);
    for (size_t i = 0; i < RECORDINGS; i++) {
        TEST_ASSERT_EQUAL_DOUBLE(0.0, recordings[i].clock_s);
    }
    free(residual);
    samples_close(&samples);
}

static void test_hum_of_several_recordings_is_one_finding(void) {
    static const double truth[] = {hum_hz, hum_um};
    answer_t diagnosis;
    TEST_ASSERT_TRUE_MESSAGE(diagnose(NULL, recordings, RECORDINGS, &diagnosis, &failure), failure.text);
    TEST_ASSERT_EQUAL_UINT64(1, diagnosis.findings);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, recordings[1].clock_s); /* who asked keeps his own */
    TEST_ASSERT_EQUAL_STRING("mains_interference", diagnosis.finding[0].block->name);
    TEST_ASSERT_EQUAL_INT(NAMED, diagnosis.finding[0].certainty);
    TEST_ASSERT_EQUAL_INT(EXPLAINED, diagnosis.verdict);
    const model_block_t *found = model_find(&diagnosis.model, "mains_interference");
    for (size_t p = 0; p < 2; p++) {
        const parameter_t *number = &found->parameter[p];
        TEST_ASSERT_DOUBLE_WITHIN(3.0 * number->sigma[0], truth[p], number->value[0]);
    }
    answer_free(&diagnosis);
}

int main(void) {
    rng = random_start("diagnosis_line_clock", 20261122);
    UNITY_BEGIN();
    RUN_TEST(test_clocks_are_found);
    RUN_TEST(test_without_lines_no_clock_is_set);
    if (!INSTRUMENTED) { /* hum is diagnosed in test_diagnose, several recordings in test_diagnosis_zeros */
        RUN_TEST(test_hum_of_several_recordings_is_one_finding);
    }
    return UNITY_END();
}
