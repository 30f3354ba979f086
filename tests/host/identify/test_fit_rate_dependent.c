/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Rate dependence: found when it is there, nothing when it is not, and always with an inverse that is stable.
 */
#include "chain/catalogue.h"
#include "identify/fit.h"
#include "support.h"
#include "unity.h"
#include <math.h>
#include <stdio.h>

enum { OPERATORS = 4, SAMPLES = 9000 };

static const double rate_hz = 1000.0, noise_um = 0.01;
static const double weights[OPERATORS + 1] = {0.06, 0.03, 0.02, 0.02, 0.02}, thresholds[OPERATORS] = {20, 40, 60, 80};

void setUp(void) {
}
void tearDown(void) {
}

/* Triangles from 2.5 to 50 Hz between -100 and 100 V, in turn, so that every third holds them all. */
static void make_recording(recording_t *recording, double beta_s, double filter_s, uint64_t seed) {
    static const size_t half_periods[] = {200, 200, 100, 100, 50, 50, 25, 25, 10, 10, 10, 10};
    const size_t count = sizeof half_periods / sizeof half_periods[0];
    model_t truth;
    model_block_t *block;
    random_t random = {seed};
    size_t k = 0;
    make_bank_model(&truth, rate_hz, 1.0, OPERATORS, weights, thresholds);
    block = model_append(&truth, &block_rate_dependent_hysteresis);
    model_set(block, "beta_s", beta_s);
    model_set(block, "rate_filter_s", filter_s);
    model_set(block, "limit_v", 25.0); /* 1.05 * 100 V - 80 V, as in a fit */
    recording_create(recording, "synthetic", rate_hz, SAMPLES);
    for (size_t line = 0; k < SAMPLES; line++) {
        const size_t length = half_periods[line % count];
        for (size_t i = 0; i < length && k < SAMPLES; i++, k++) {
            const double rising = -100.0 + 200.0 * (double)i / (double)length;
            recording->column[COLUMN_DRIVE][k] = line % 2 == 0 ? rising : -rising;
        }
    }
    simulate_into(recording, &truth, 1);
    for (k = 0; k < SAMPLES; k++) {
        recording->column[COLUMN_DISPLACEMENT][k] += noise_um * random_normal(&random);
    }
    model_free(&truth);
}

static void fit(const recording_t *recording, size_t operators, model_t *model, fit_report_t *report) {
    const fit_options_t options = {.operators = operators};
    failure_t failure = {{0}};
    TEST_ASSERT_TRUE_MESSAGE(
        fit_recordings(&family_rate_dependent_prandtl_ishlinskii, recording, 1, &options, model, report, &failure),
        failure.text);
}

static void expect_stable_inverse(const model_t *model) {
    const model_block_t *rate = model_find(model, "rate_dependent_hysteresis");
    const parameter_t *found = model_parameter(model_find(model, "prandtl_ishlinskii"), "weights");
    const double beta = model_parameter(rate, "beta_s")->value[0],
                 filter = model_parameter(rate, "rate_filter_s")->value[0];
    const double g = filter > 0.0 ? -expm1(-1.0 / (rate_hz * filter)) : 1.0;
    double slope = 0.0;
    for (size_t i = 0; i < found->count; i++) {
        slope += found->value[i];
        TEST_ASSERT_TRUE(g * beta * rate_hz * (slope - found->value[0]) / slope <= 0.9);
    }
}

static void test_finds_beta_and_filter(void) {
    const double beta_s = 0.0015, filter_s = 0.004;
    recording_t recording;
    model_t model;
    fit_report_t report;
    make_recording(&recording, beta_s, filter_s, 21);
    fit(&recording, OPERATORS, &model, &report);
    const parameter_t *beta = model_parameter(model_find(&model, "rate_dependent_hysteresis"), "beta_s");
    const parameter_t *filter = model_parameter(model_find(&model, "rate_dependent_hysteresis"), "rate_filter_s");
    const parameter_t *found = model_parameter(model_find(&model, "prandtl_ishlinskii"), "weights");
    printf(
        "seed 21: beta %.5f ms (true %.5f, sigma %.5f), filter %.4f ms (true %.4f), held out %.4f %%, fixed %.4f %%\n",
        1e3 * beta->value[0], 1e3 * beta_s, 1e3 * beta->sigma[0], 1e3 * filter->value[0], 1e3 * filter_s,
        report.held_out_nrmse_percent, report.without_held_out_nrmse_percent);
    TEST_ASSERT_TRUE(fabs(beta->value[0] - beta_s) < 4.0 * beta->sigma[0] && beta->sigma[0] < 0.01 * beta_s);
    TEST_ASSERT_TRUE(fabs(filter->value[0] - filter_s) < 4.0 * filter->sigma[0] && filter->sigma[0] < 0.01 * filter_s);
    for (size_t i = 0; i <= OPERATORS; i++) { /* 6000 samples of 0.01 um over 80 V: a few 1e-5, and the error of beta */
        TEST_ASSERT_DOUBLE_WITHIN(3e-4, weights[i], found->value[i]);
    }
    TEST_ASSERT_TRUE(report.without_held_out_nrmse_percent > 10.0 * report.held_out_nrmse_percent);
    expect_stable_inverse(&model);
    model_free(&model);
    fit_report_free(&report);
    recording_free(&recording);
}

static void test_finds_nothing_where_there_is_nothing(void) {
    recording_t recording;
    model_t model;
    fit_report_t report;
    make_recording(&recording, 0.0, 0.0, 22);
    fit(&recording, OPERATORS, &model, &report);
    const double beta = model_parameter(&model.block[0], "beta_s")->value[0];
    printf("seed 22: beta %.3g s where it is 0\n", beta);
    TEST_ASSERT_TRUE(beta == 0.0);
    TEST_ASSERT_DOUBLE_WITHIN(0.02 * report.held_out_nrmse_percent, report.without_held_out_nrmse_percent,
                              report.held_out_nrmse_percent);
    model_free(&model);
    fit_report_free(&report);
    recording_free(&recording);
}

/* The numbers of the source, beta / dt = 2 without a filter, have no stable inverse: the fit stays inside what an
 * amplifier can run. */
static void test_stays_stable_when_the_truth_is_not(void) {
    recording_t recording;
    model_t model;
    fit_report_t report;
    make_recording(&recording, 0.002, 0.0, 23);
    fit(&recording, OPERATORS, &model, &report);
    printf("seed 23: held out %.4f %%, with fixed thresholds %.4f %%\n", report.held_out_nrmse_percent,
           report.without_held_out_nrmse_percent);
    expect_stable_inverse(&model);
    TEST_ASSERT_TRUE(report.held_out_nrmse_percent < report.without_held_out_nrmse_percent);
    model_free(&model);
    fit_report_free(&report);
    recording_free(&recording);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_finds_beta_and_filter);
    RUN_TEST(test_finds_nothing_where_there_is_nothing);
    RUN_TEST(test_stays_stable_when_the_truth_is_not);
    return UNITY_END();
}
