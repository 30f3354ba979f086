/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Two recordings as one question: each has a zero, a past and a lag of its own, which the reply has with their size;
 * and no baseline delivers more error than a straight line or thirty plays. */
#include "diagnosis/account/account.h"
#include "diagnosis/diagnose.h"
#include "diagnosis/review/delivered.h"
#include "report/diagnosis_text.h"
#include "support.h"
#include "unity.h"
#include <gsl/gsl_math.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SAMPLES = 6000, OPERATORS = 20 };
static const double rate_hz = 1000.0, noise_um = 0.003, zero_um = 1.5;
static random_t rng;
static recording_t recording[2];
static model_t model;
static answer_t answer;
static account_t account;
static failure_t failure;

void setUp(void) {
    double weights[OPERATORS + 1] = {0.09}, thresholds[OPERATORS];
    for (size_t i = 0; i < OPERATORS; i++) {
        thresholds[i] = 2.4 * (double)(i + 1);
        weights[i + 1] = 0.005 * exp(-0.08 * (double)i);
    }
    make_bank_model(&model, rate_hz, 1.0, OPERATORS, weights, thresholds);
    for (size_t r = 0; r < 2; r++) {
        recording_create(&recording[r], r == 0 ? "first.csv" : "second.csv", rate_hz, SAMPLES);
    }
}

void tearDown(void) {
    account_free(&account);
    account = (account_t){0};
    answer_free(&answer);
    answer = (answer_t){0};
    model_free(&model);
    recording_free(&recording[0]);
    recording_free(&recording[1]);
}

/* A sweep over the whole range, and sines that repeat nothing. */
static void fill(recording_t *r, double slow_hz) {
    for (size_t k = 0; k < SAMPLES; k++) {
        const double t = (double)k / rate_hz;
        r->column[COLUMN_DRIVE][k] = t < 1.0 ? 50.0 - 50.0 * cos(2.0 * M_PI * t)
                                             : 48.0 * (1.0 - cos(2.0 * M_PI * slow_hz * (t - 1.0))) / 2.0 +
                                                   26.0 * (1.0 - cos(2.0 * M_PI * 2.7 * slow_hz * (t - 1.0))) / 2.0 +
                                                   20.0 * (1.0 - cos(2.0 * M_PI * 6.1 * slow_hz * (t - 1.0))) / 2.0;
    }
    simulate_into(r, &model, 1);
}

static void add_noise(recording_t *r, double zero, size_t late) {
    double *y = r->column[COLUMN_DISPLACEMENT];
    for (size_t k = SAMPLES; k-- > 0;) {
        y[k] = y[k >= late ? k - late : 0] + zero + noise_um * random_normal(&rng);
    }
}

static void ask(size_t count) {
    TEST_ASSERT_TRUE_MESSAGE(diagnose(NULL, recording, count, &answer, &failure), failure.text);
    TEST_ASSERT_TRUE_MESSAGE(account_for(&answer, recording, count, &account, &failure), failure.text);
}

/* As if each were alone: nothing is missing, the zero comes out to a tenth of the noise, and neither is late. */
static void test_each_file_has_its_zero(void) {
    fill(&recording[0], 1.31);
    fill(&recording[1], 0.97);
    add_noise(&recording[0], 0.0, 0);
    add_noise(&recording[1], zero_um, 0);
    ask(2);
    printf("zero %.4f um, told %.4f %%, delivered %.4f %%\n", account.taken_out[1].offset_um, answer.held_out_percent,
           answer.delivered_percent);
    TEST_ASSERT_EQUAL_UINT64(0, answer.findings);
    TEST_ASSERT_EQUAL_INT(NOTHING_MISSING, answer.verdict);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, account.taken_out[0].offset_um);
    TEST_ASSERT_DOUBLE_WITHIN(0.1 * noise_um, zero_um, account.taken_out[1].offset_um);
    /* The error of samples that count is that of all: a tenth covers what chance makes of so many. */
    TEST_ASSERT_DOUBLE_WITHIN(0.1 * answer.held_out_percent, answer.held_out_percent, answer.delivered_percent);
    TEST_ASSERT_TRUE(answer.baseline_delivered_percent <= fmin(answer.line_percent, answer.plays_percent));
    for (size_t r = 0; r < 2; r++) {
        TEST_ASSERT_FALSE(taken_out_lags(&account.taken_out[r], 2));
        TEST_ASSERT_EQUAL_DOUBLE(0.0, account.taken_out[r].past_rms_um);
    }
}

/* A file that was made with a filter of 4 ms is reported, with the difference between both: the model's own lag is in
 * between. */
static void test_a_file_that_is_late_is_told(void) {
    fill(&recording[0], 1.31);
    fill(&recording[1], 0.97);
    add_noise(&recording[0], 0.0, 0);
    add_noise(&recording[1], 0.0, 4);
    ask(2);
    const taken_out_t *taken = account.taken_out;
    printf("%.3f +- %.3f ms and %.3f +- %.3f ms\n", 1e3 * taken[0].lag_s, 1e3 * taken[0].lag_sigma_s,
           1e3 * taken[1].lag_s, 1e3 * taken[1].lag_sigma_s);
    TEST_ASSERT_TRUE(taken_out_lags(&taken[1], 2) || taken_out_lags(&taken[0], 2));
    TEST_ASSERT_TRUE(taken[1].lag_s > taken[0].lag_s);
    /* A lag of a model is no constant delay; and the loops are widened a little by what is shared between both. */
    TEST_ASSERT_DOUBLE_WITHIN(0.001, 0.004, taken[1].lag_s - taken[0].lag_s);
    TEST_ASSERT_FALSE(taken_out_lags(&taken[1], 1)); /* of one there is nothing to compare with */
}

/* A hold and a ring at the beginning, of a past that nobody recorded. A model that plays beat on the whole recording
 * has to leave less than they where samples count, and its caveat says so. */
static void test_no_baseline_is_worse_than_a_plain_one(void) {
    recording_t *r = &recording[0];
    double *y = r->column[COLUMN_DISPLACEMENT];
    fill(r, 1.31);
    double *u = r->column[COLUMN_DRIVE];
    for (size_t k = 0; k < SAMPLES; k++) { /* a jump from the hold into the sines, which end 0.2 s before the file */
        u[k] = k < 800 ? 10.0 : u[k + 200 < SAMPLES ? k + 200 : SAMPLES - 1];
    }
    simulate_into(r, &model, 1);
    add_noise(r, 0.0, 0);
    for (size_t k = 800; k < SAMPLES; k++) {
        const double t = (double)(k - 800) / rate_hz;
        y[k] += 0.8 * exp(-12.0 * t) * cos(2.0 * M_PI * 62.0 * t);
    }
    ask(1);
    printf("delivers %.3f %%, a line %.3f %%, plays %.3f %%\n", answer.baseline_delivered_percent, answer.line_percent,
           answer.plays_percent);
    char caveat[DIAGNOSIS_LINE];
    const double plain = fmin(answer.line_percent, answer.plays_percent);
    (void)verdict_caveat(&answer, caveat);
    TEST_ASSERT_TRUE(answer.delivered_percent < 0.5 * answer.line_percent);
    TEST_ASSERT_TRUE(answer.delivered_percent <= plain || answer.held_out_percent < plain);
    TEST_ASSERT_EQUAL_INT(answer.delivered_percent > plain, strstr(caveat, "30 play operators alone") != NULL);
}

int main(void) {
    rng = random_start("diagnosis_zeros", 20261125U);
    UNITY_BEGIN();
    RUN_TEST(test_each_file_has_its_zero);
    if (!INSTRUMENTED) { /* the code that the test before runs */
        RUN_TEST(test_a_file_that_is_late_is_told);
    }
    RUN_TEST(test_no_baseline_is_worse_than_a_plain_one);
    return UNITY_END();
}
