/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Creep in a synthetic recording is found, its size within the stated error; where there is none, none is claimed. */
#include "chain/catalogue.h"
#include "identify/creep_search.h"
#include "identify/fit.h"
#include "support.h"
#include "unity.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { SAMPLES = 12000, PER_LINE = 100 };

static const double rate_hz = 200.0, noise_um = 0.02;
static const double weights[] = {0.08, 0.02, 0.015, 0.01, 0.03};
static const double thresholds[] = {20, 40, 60, 80};
/* Sweeps and holds at both ends, so that creep has time to show. */
static const double corners[] = {0, 100, 100, 100, 100, -100, -100, -100, -100, 100, -50, 50, 50, 50, -100, 100, 0};

void setUp(void) {
}
void tearDown(void) {
}

static void make_recording(recording_t *recording, double gamma, uint64_t seed) {
    random_t random = {seed};
    model_t truth;
    make_bank_model(&truth, rate_hz, 3.0, 4, weights, thresholds);
    if (gamma != 0.0) {
        model_set(model_append(&truth, &block_creep), "gamma_per_decade", gamma);
    }
    recording_create(recording, "synthetic", rate_hz, SAMPLES);
    fill_lines(recording->column[COLUMN_DRIVE], SAMPLES, corners, sizeof corners / sizeof corners[0], PER_LINE);
    simulate_into(recording, &truth, 1);
    for (size_t k = 0; k < SAMPLES; k++) {
        recording->column[COLUMN_DISPLACEMENT][k] += noise_um * random_normal(&random);
    }
    model_free(&truth);
}

static void fit(const recording_t *recording, bool creep, model_t *model, fit_report_t *report) {
    const fit_options_t options = {.operators = 4, .creep = creep};
    failure_t failure = {{0}};
    TEST_ASSERT_TRUE_MESSAGE(
        fit_recordings(&family_prandtl_ishlinskii, recording, 1, &options, model, report, &failure), failure.text);
}

static void test_finds_gamma_and_predicts_better(void) {
    const double gammas[] = {0.005, 0.015, 0.04};
    for (size_t i = 0; i < 3; i++) {
        recording_t recording;
        model_t model, plain;
        fit_report_t report, plain_report;
        make_recording(&recording, gammas[i], 11 + i);
        fit(&recording, true, &model, &report);
        fit(&recording, false, &plain, &plain_report);
        const model_block_t *block = model_find(&model, "creep");
        TEST_ASSERT_NOT_NULL(block);
        const parameter_t *gamma = model_parameter(block, "gamma_per_decade");
        printf("seed %zu: gamma %.5f +- %.5f, true %.5f; held out %.4f %% with, %.4f %% without\n", 11 + i,
               gamma->value[0], gamma->sigma[0], gammas[i], report.held_out_nrmse_percent,
               plain_report.held_out_nrmse_percent);
        TEST_ASSERT_TRUE(fabs(gamma->value[0] - gammas[i]) < 4.0 * gamma->sigma[0]);
        TEST_ASSERT_TRUE(gamma->sigma[0] < 0.1 * gammas[i]);
        TEST_ASSERT_TRUE(report.held_out_nrmse_percent < plain_report.held_out_nrmse_percent);
        /* The noise is all that is left: its part of the peak-to-peak displacement, and 5 % for a gamma that is not
         * exact. */
        double low = HUGE_VAL, high = -HUGE_VAL;
        for (size_t k = 2 * SAMPLES / 3; k < SAMPLES; k++) {
            low = fmin(low, recording.column[COLUMN_DISPLACEMENT][k]);
            high = fmax(high, recording.column[COLUMN_DISPLACEMENT][k]);
        }
        TEST_ASSERT_TRUE(report.held_out_nrmse_percent < 1.05 * 100.0 * noise_um / (high - low));
        model_free(&model);
        model_free(&plain);
        fit_report_free(&report);
        fit_report_free(&plain_report);
        recording_free(&recording);
    }
}

static void test_claims_no_creep_where_there_is_none(void) {
    recording_t recording;
    model_t model;
    fit_report_t report;
    make_recording(&recording, 0.0, 21);
    fit(&recording, true, &model, &report);
    const model_block_t *block = model_find(&model, "creep");
    if (block != NULL) { /* found, but then as nothing */
        const parameter_t *gamma = model_parameter(block, "gamma_per_decade");
        printf("seed 21: gamma %.6f where it is 0\n", gamma->value[0]);
        TEST_ASSERT_TRUE(fabs(gamma->value[0]) < 4.0 * gamma->sigma[0]);
    }
    model_free(&model);
    fit_report_free(&report);
    recording_free(&recording);
}

/* Removing is the exact inverse of applying. */
static void test_remove_undoes_apply(void) {
    random_t random = {31};
    const creep_cells_t cells = creep_default_cells(0.03, 1000.0);
    double elastic[3000], position[3000], found[3000];
    for (size_t k = 0; k < 3000; k++) {
        elastic[k] = 10.0 * random_normal(&random);
    }
    creep_apply(&cells, elastic, 3000, 4.0, position);
    creep_remove(&cells, position, 3000, 4.0, found);
    for (size_t k = 0; k < 3000; k++) {
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, elastic[k], found[k]);
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_finds_gamma_and_predicts_better);
    RUN_TEST(test_claims_no_creep_where_there_is_none);
    RUN_TEST(test_remove_undoes_apply);
    return UNITY_END();
}
