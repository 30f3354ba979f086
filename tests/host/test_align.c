/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Header key displacement_sampled_after_s: a skew between the columns that is known is no delay of the actuator. */
#include "chain/align.h"
#include "chain/chain.h"
#include "support.h"
#include "unity.h"
#include <gsl/gsl_math.h>
#include <stdlib.h>
#include <string.h>

enum { SAMPLES = 4000, ROOM = 40 };

static const double rate_hz = 5000.0;
static recording_t recording;
static failure_t failure;

void setUp(void) {
}
void tearDown(void) {
    recording_free(&recording);
}

/* Two tones, 40 samples or more each: a cubic between the samples is wrong by (2 pi / 40)^4 * 3 / 128 or less, 1.4e-5
 * of an amplitude. */
static double drive_at(double sample) {
    return 50.0 + 30.0 * sin(2.0 * M_PI * sample / 400.0) + 10.0 * sin(2.0 * M_PI * sample / 40.0);
}

/* A position that follows at once, sampled `after` samples behind its row's drive. */
static void record(double after) {
    char text[40];
    recording_create(&recording, "skewed", rate_hz, SAMPLES);
    double *reference = recording_add_column(&recording, COLUMN_REFERENCE);
    double *voltage = recording_add_column(&recording, COLUMN_VOLTAGE);
    recording.start_s = 1.0;
    for (size_t k = 0; k < SAMPLES; k++) {
        recording.column[COLUMN_DRIVE][k] = drive_at((double)k);
        reference[k] = 0.2 * drive_at((double)k);
        voltage[k] = drive_at((double)k + after);
        recording.column[COLUMN_DISPLACEMENT][k] = 0.1 * drive_at((double)k + after);
    }
    (void)snprintf(text, sizeof text, "%.9g", after / rate_hz);
    recording_set_key(&recording, "displacement_sampled_after_s", text);
}

static double largest_error(void) {
    double worst = 0.0;
    for (size_t k = 0; k < recording.samples; k++) {
        const double u = 10.0 * recording.column[COLUMN_DISPLACEMENT][k];
        worst = fmax(worst, fabs(recording.column[COLUMN_DRIVE][k] - u));
        worst = fmax(worst, fabs(5.0 * recording.column[COLUMN_REFERENCE][k] - u));
        worst = fmax(worst, fabs(recording.column[COLUMN_VOLTAGE][k] - u));
    }
    return worst;
}

static void test_columns_are_at_the_same_instants_afterwards(void) {
    static const double after[] = {0.3, -0.3, 0.75, 2.0, -3.0, 7.4, -5.6};
    for (size_t i = 0; i < sizeof after / sizeof after[0]; i++) {
        const bool whole = after[i] == round(after[i]);
        const size_t dropped = (size_t)ceil(fabs(after[i]));
        record(after[i]);
        TEST_ASSERT_TRUE(largest_error() > 0.3 * fabs(after[i])); /* V: it moves up to 2 V a sample */
        TEST_ASSERT_TRUE_MESSAGE(recording_align(&recording, &failure), failure.text);
        TEST_ASSERT_EQUAL_UINT64(SAMPLES - dropped, recording.samples);
        /* A line is wrong by 1/8 of the second difference, 0.25 V of 10 V at 40 samples a period; it is what is used
         * in the last interval, whose end has no sample behind it. */
        const double error = largest_error();
        TEST_ASSERT_TRUE_MESSAGE(error < (whole ? 1e-6 : 0.25 / 8.0), "error");
        TEST_ASSERT_EQUAL_DOUBLE(1.0 + (after[i] < 0.0 ? (double)dropped / rate_hz : 0.0), recording.start_s);
        TEST_ASSERT_EQUAL_STRING("0", recording_key(&recording, "displacement_sampled_after_s"));
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, after[i] / rate_hz, strtod(recording_key(&recording, "drive_moved_s"), NULL));
        TEST_ASSERT_NOT_NULL(strstr(recording.understood, after[i] > 0.0 ? "later" : "earlier"));
        /* Once is enough. */
        const size_t left = recording.samples;
        TEST_ASSERT_TRUE(recording_align(&recording, &failure));
        TEST_ASSERT_EQUAL_UINT64(left, recording.samples);
        recording_free(&recording);
    }
}

/* A position sampled before the drive, by a part of a sample, is a delay block's output. */
static void test_a_part_of_a_sample_is_a_delay_block(void) {
    model_t model = {.sample_rate_hz = rate_hz};
    const double weights[] = {0.08, 0.03, 0.02}, thresholds[] = {5.0, 20.0}, after_s = -0.3 / rate_hz;
    double *late = allocate(SAMPLES, sizeof *late), *aligned = allocate(SAMPLES, sizeof *aligned);
    make_bank_model(&model, rate_hz, 2.0, 2, weights, thresholds);
    record(-0.3);
    model_append(&model, &block_transport_delay);
    const model_block_t bank = model.block[0];
    model.block[0] = model.block[1];
    model.block[1] = bank;
    model_set(&model.block[0], "delay_s", -after_s);
    TEST_ASSERT_TRUE_MESSAGE(chain_simulate(&model, &recording, 1, late, &failure), failure.text);
    model_set(&model.block[0], "delay_s", 0.0);
    TEST_ASSERT_TRUE(recording_align(&recording, &failure));
    TEST_ASSERT_TRUE(chain_simulate(&model, &recording, 1, aligned, &failure));
    for (size_t k = SAMPLES / 2; k + 3 < SAMPLES; k++) { /* two periods: the plays have forgotten how it began */
        /* What is between two samples and goes beyond both is the block's alone: at a turn of the fast tone at most
         * (pi / 40)^2 / 2 of 10 V, by weights of 0.13 um/V. */
        TEST_ASSERT_DOUBLE_WITHIN(0.0041, late[k + 1], aligned[k]);
    }
    free(late);
    free(aligned);
    model_free(&model);
}

static void test_no_key_changes_nothing(void) {
    record(0.0);
    TEST_ASSERT_TRUE(recording_align(&recording, &failure));
    TEST_ASSERT_EQUAL_UINT64(SAMPLES, recording.samples);
    TEST_ASSERT_NULL(recording_key(&recording, "drive_moved_s"));
    TEST_ASSERT_NULL(recording.understood);
}

static void test_bad_keys_are_refused(void) {
    static const struct {
        const char *value, *says;
    } bad[] = {{"soon", "'soon', not a number of seconds"},
               {"nan", "not a number"},
               {"", "not a number"},
               {"0.5", "less than half"},
               {"-1e300", "less than half"}};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        record(0.0);
        recording_set_key(&recording, "displacement_sampled_after_s", bad[i].value);
        TEST_ASSERT_FALSE(recording_align(&recording, &failure));
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(failure.text, bad[i].says), failure.text);
        TEST_ASSERT_EQUAL_UINT64(SAMPLES, recording.samples);
        recording_free(&recording);
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_columns_are_at_the_same_instants_afterwards);
    RUN_TEST(test_a_part_of_a_sample_is_a_delay_block);
    RUN_TEST(test_no_key_changes_nothing);
    RUN_TEST(test_bad_keys_are_refused);
    return UNITY_END();
}
