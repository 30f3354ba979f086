/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What explains something and is no physics: a lag of a hundredth of a sample, a mode that no sample shows, and a
 * line at a harmonic of the drive that the rests do not show. */
#include "diagnosis/answer/state.h"
#include "diagnosis/judgement/no_physics.h"
#include "support.h"
#include "unity.h"
#include <gsl/gsl_math.h>

enum { SAMPLES = 20000 };

static const double rate_hz = 2000.0, drive_hz = 4.0;
static recording_t recording;
static samples_t samples;
static model_t bank;
static failure_t failure;

/* A triangle wave, with rests before and behind it where wanted; the line is on all of the position. */
static void record(bool rests, double line_hz, double moving_um, double resting_um) {
    static const double weight[1] = {0.1};
    recording_create(&recording, "lines", rate_hz, SAMPLES);
    for (size_t k = 0; k < SAMPLES; k++) {
        const double t = (double)k / rate_hz, turns = drive_hz * t;
        const bool rest = rests && (k < SAMPLES / 8 || k >= SAMPLES - SAMPLES / 8);
        const double u = rest ? 0.0 : 20.0 * (fabs(2.0 * (turns - floor(turns)) - 1.0) - 0.5);
        recording.column[COLUMN_DRIVE][k] = u;
        recording.column[COLUMN_DISPLACEMENT][k] =
            0.1 * u + (rest ? resting_um : moving_um) * sin(2.0 * M_PI * line_hz * t);
    }
    make_bank_model(&bank, rate_hz, 0.0, 0, weight, NULL);
    TEST_ASSERT_TRUE_MESSAGE(samples_open(&samples, &bank, &recording, 1, &failure), failure.text);
}

void setUp(void) {
}

void tearDown(void) {
    samples_close(&samples);
    model_free(&bank);
    recording_free(&recording);
}

static bool is_none(const block_t *block, const double *value) {
    model_t with;
    insert_block(&with, &bank, block, value);
    const bool none = no_physics(&samples, model_find(&with, block->name));
    model_free(&with);
    return none;
}

static void test_a_lag_of_less_than_a_fiftieth_of_a_sample(void) {
    record(false, 0.0, 0.0, 0.0);
    TEST_ASSERT_TRUE(is_none(&block_transport_delay, (double[]){0.019 / rate_hz}));
    TEST_ASSERT_FALSE(is_none(&block_transport_delay, (double[]){0.021 / rate_hz}));
    TEST_ASSERT_TRUE(is_none(&block_amplifier_bandwidth, (double[]){rate_hz / (2.0 * M_PI * 0.019)}));
    TEST_ASSERT_FALSE(is_none(&block_amplifier_bandwidth, (double[]){rate_hz / (2.0 * M_PI * 0.021)}));
    TEST_ASSERT_TRUE(is_none(&block_sensor_bandwidth, (double[]){rate_hz / (2.0 * M_PI * 0.019)}));
    TEST_ASSERT_FALSE(is_none(&block_resonance, (double[]){0.4 * rate_hz, 0.01})); /* no lag */
}

/* Of a second mode there no sample shows the ringing: with it a single mode was called two. */
static void test_a_mode_above_half_of_the_sample_rate(void) {
    record(false, 0.0, 0.0, 0.0);
    TEST_ASSERT_TRUE(is_none(&block_resonance, (double[]){0.51 * rate_hz, 0.01}));
    TEST_ASSERT_TRUE(is_none(&block_two_modes, (double[]){0.05 * rate_hz, 0.02, 0.51 * rate_hz, 0.02, -0.2}));
    TEST_ASSERT_FALSE(is_none(&block_two_modes, (double[]){0.05 * rate_hz, 0.02, 0.49 * rate_hz, 0.02, -0.2}));
    TEST_ASSERT_FALSE(is_none(&block_sensor_filter, (double[]){0.6 * rate_hz, 0.7})); /* a lag */
}

static void test_a_harmonic_of_a_drive_that_never_rests(void) {
    record(false, 0.0, 0.0, 0.0);
    TEST_ASSERT_TRUE(is_none(&block_mains_interference, (double[BLOCK_MAX_PARAMETERS]){12.0, 0.01, 0.0}));
    TEST_ASSERT_TRUE(is_none(&block_mains_interference, (double[BLOCK_MAX_PARAMETERS]){100.0, 0.01, 0.0}));
    TEST_ASSERT_FALSE(
        is_none(&block_mains_interference, (double[BLOCK_MAX_PARAMETERS]){50.0, 0.01, 0.0})); /* 12.5 times 4 Hz */
    TEST_ASSERT_FALSE(is_none(&block_mains_interference, (double[BLOCK_MAX_PARAMETERS]){101.0, 0.01, 0.0}));
}

static void test_a_rest_shows_whether_it_is_hum(void) {
    record(true, 100.0, 0.01, 0.0); /* only while it moves */
    TEST_ASSERT_TRUE(is_none(&block_mains_interference, (double[BLOCK_MAX_PARAMETERS]){100.0, 0.01, 0.0}));
}

static void test_hum_at_a_harmonic_is_hum(void) {
    record(true, 100.0, 0.01, 0.01);
    TEST_ASSERT_FALSE(is_none(&block_mains_interference, (double[BLOCK_MAX_PARAMETERS]){100.0, 0.01, 0.0}));
}

/* Lines of a constant length between levels that never come again, as a pattern has. */
static void test_a_drive_that_turns_at_regular_times(void) {
    enum { LINE = 50 };
    record(false, 0.0, 0.0, 0.0);
    double level[2] = {0.0, 0.0};
    for (size_t k = 0; k < SAMPLES; k++) {
        if (k % LINE == 0) {
            const size_t line = k / LINE;
            level[0] = level[1];
            level[1] = (line % 2 == 0 ? 1.0 : -1.0) * (6.0 + 4.0 * sin(0.7 * (double)(line * line)));
        }
        recording.column[COLUMN_DRIVE][k] = level[0] + (level[1] - level[0]) * (double)(k % LINE) / LINE;
    }
    TEST_ASSERT_TRUE(
        is_none(&block_mains_interference, (double[BLOCK_MAX_PARAMETERS]){220.0, 0.01, 0.0})); /* 11 times 20 Hz */
    TEST_ASSERT_FALSE(
        is_none(&block_mains_interference, (double[BLOCK_MAX_PARAMETERS]){210.0, 0.01, 0.0})); /* 10.5 times */
    recording.column[COLUMN_DRIVE][SAMPLES / 2] = 100.0;                                       /* one more turn */
    TEST_ASSERT_FALSE(is_none(&block_mains_interference, (double[BLOCK_MAX_PARAMETERS]){220.0, 0.01, 0.0}));
}

static void test_a_drive_that_does_not_repeat_itself_has_no_harmonics(void) {
    record(true, 100.0, 0.01, 0.0);
    for (size_t k = 0; k < SAMPLES; k++) {
        recording.column[COLUMN_DRIVE][k] += 5.0 * sin(1e-6 * (double)(k * k));
    }
    TEST_ASSERT_FALSE(is_none(&block_mains_interference, (double[BLOCK_MAX_PARAMETERS]){100.0, 0.01, 0.0}));
}

/* What the drive makes may change once in the whole of a recording, as where a raster's line moves on: its line is
 * then two frequencies wide. In 10 s a harmonic at 100 Hz and the line 0.16 Hz beside it are one; 0.3 Hz are not. */
static void test_a_line_beside_a_harmonic(void) {
    record(false, 100.16, 0.01, 0.0);
    TEST_ASSERT_TRUE(is_none(&block_mains_interference, (double[BLOCK_MAX_PARAMETERS]){100.16, 0.01, 0.0}));
    TEST_ASSERT_TRUE(is_none(&block_mains_interference, (double[BLOCK_MAX_PARAMETERS]){99.84, 0.01, 0.0}));
    TEST_ASSERT_FALSE(is_none(&block_mains_interference, (double[BLOCK_MAX_PARAMETERS]){100.3, 0.01, 0.0}));
}

/* A frequency of something that has no size is none. */
static void test_a_block_without_its_size_is_not_determined(void) {
    static const struct {
        double amplitude_um, sigma_um;
        bool determined;
    } cases[] = {{4.7e-6, HUGE_VAL, false}, {0.01, 0.005, false}, {0.01, 0.003, true}};
    record(false, 44.1, 0.01, 0.0);
    for (size_t i = 0; i < 3; i++) {
        model_t with;
        insert_block(&with, &bank, &block_mains_interference,
                     (double[BLOCK_MAX_PARAMETERS]){44.1, cases[i].amplitude_um, 1.0});
        model_block_t *block = (model_block_t *)model_find(&with, "mains_interference");
        for (size_t p = 0; p < 3; p++) {
            block->parameter[p].sigma = allocate(1, sizeof(double));
            block->parameter[p].sigma[0] = p == 0 ? 0.001 : p == 1 ? cases[i].sigma_um : 0.1;
        }
        TEST_ASSERT_EQUAL_INT(cases[i].determined, block_determined(block));
        model_free(&with);
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_lag_of_less_than_a_fiftieth_of_a_sample);
    RUN_TEST(test_a_mode_above_half_of_the_sample_rate);
    RUN_TEST(test_a_harmonic_of_a_drive_that_never_rests);
    RUN_TEST(test_a_rest_shows_whether_it_is_hum);
    RUN_TEST(test_hum_at_a_harmonic_is_hum);
    RUN_TEST(test_a_drive_that_turns_at_regular_times);
    RUN_TEST(test_a_drive_that_does_not_repeat_itself_has_no_harmonics);
    RUN_TEST(test_a_line_beside_a_harmonic);
    RUN_TEST(test_a_block_without_its_size_is_not_determined);
    return UNITY_END();
}
