/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Recordings with unlike sample rates are diagnosed together: one path at three speeds, each with as many samples a
 * period, as laboratories record it. What goes with time and not with the path is what the speeds differ by. */
#include "diagnosis/diagnose.h"
#include "support.h"
#include "unity.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

enum { SAMPLES = 5000, SPEEDS = 3, PLAYS = 100 };
static const double rate_hz[SPEEDS] = {500.0, 5000.0, 25000.0}, noise_um = 0.01;
static recording_t recording[SPEEDS];
static model_t truth;
static answer_t diagnosis;
static failure_t failure;
static random_t rng;

void setUp(void) {
    for (size_t i = 0; i < SPEEDS; i++) {
        static const char *const name[SPEEDS] = {"slow.csv", "middle.csv", "fast.csv"};
        recording_create(&recording[i], name[i], rate_hz[i], SAMPLES);
        if (i == 0) {
            fill_tones(recording[0].column[COLUMN_DRIVE], SAMPLES, rate_hz[0], 20.0, &rng);
        } else {
            memcpy(recording[i].column[COLUMN_DRIVE], recording[0].column[COLUMN_DRIVE], SAMPLES * sizeof(double));
        }
    }
    make_fine_bank_model(&truth, rate_hz[0], PLAYS);
}

void tearDown(void) {
    answer_free(&diagnosis);
    model_free(&truth);
    for (size_t i = 0; i < SPEEDS; i++) {
        recording_free(&recording[i]);
    }
}

/* Noise that is white and 1/f has the same spectrum over cycles a sample at any rate; white noise is the plain case. */
static void diagnose_with(const block_t *block, const double *value) {
    for (size_t i = 0; i < SPEEDS; i++) {
        measure_with(&recording[i], &truth, block, value, noise_um, &rng);
    }
    TEST_ASSERT_TRUE_MESSAGE(diagnose(NULL, recording, SPEEDS, &diagnosis, &failure), failure.text);
    for (size_t i = 0; i < diagnosis.findings; i++) {
        printf("%s ", diagnosis.finding[i].block->name);
    }
    printf("held out %.3f %%\n", diagnosis.held_out_percent);
}

/* Named, with its first number to three standard errors. */
static void expect(const block_t *block, double number) {
    const parameter_t *found;
    TEST_ASSERT_EQUAL_UINT(1, diagnosis.findings);
    TEST_ASSERT_TRUE(diagnosis.finding[0].block == block);
    found = &model_find(&diagnosis.model, block->name)->parameter[0];
    printf("%g +- %g for %g\n", found->value[0], found->sigma[0], number);
    TEST_ASSERT_TRUE(fabs(found->value[0] - number) < 3.0 * found->sigma[0]);
}

/* A lag of a hundredth of a sample in the slowest recording and of half a sample in the fastest one. */
static void test_a_delay(void) {
    static const double delay_s[] = {2e-5};
    diagnose_with(&block_transport_delay, delay_s);
    expect(&block_transport_delay, delay_s[0]);
}

/* A mode that only the fastest recording can show. */
static void test_a_mode(void) {
    static const double mode[] = {900.0, 0.03};
    diagnose_with(&block_resonance, mode);
    expect(&block_resonance, mode[0]);
}

/* Creep of which each recording has another piece: 10, 1 and 0.2 s. */
static void test_creep(void) {
    static const double creep[] = {0.01, 0.1, 1000.0};
    diagnose_with(&block_creep, creep);
    expect(&block_creep, creep[0]);
}

/* 0 delay: nothing. */
static void test_nothing(void) {
    static const double none_s[] = {0.0};
    diagnose_with(&block_transport_delay, none_s);
    TEST_ASSERT_EQUAL_UINT(0, diagnosis.findings);
    TEST_ASSERT_EQUAL_INT(NOTHING_MISSING, diagnosis.verdict);
}

int main(void) {
    rng = random_start("diagnose_rates", 20261130);
    UNITY_BEGIN();
    RUN_TEST(test_a_delay);
    RUN_TEST(test_a_mode);
    RUN_TEST(test_creep);
    RUN_TEST(test_nothing);
    return UNITY_END();
}
