/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Family bouc_wen: plain Bouc-Wen from any drive. */
#include "compile/compile.h"
#include "identify/fit.h"
#include "support.h"
#include "unity.h"
#include <math.h>
#include <stdio.h>

enum { SAMPLES = 6000, RECORDINGS = 2 };
static const double rate_hz = 1000.0, noise_um = 0.005;
static failure_t failure;

void setUp(void) {
}
void tearDown(void) {
}

static void make_truth(model_t *model, double hysteretic_um) {
    model_create(model, rate_hz);
    model_block_t *block = model_append(model, &block_bouc_wen);
    model_set(block, "center_v", 50.0);
    model_set(block, "half_range_v", 50.0);
    model_set(block, "offset_um", 20.0);
    model_set(block, "direct_um", 15.0);
    model_set(block, "hysteretic_um", hysteretic_um);
    model_set(block, "beta", 1.6);
    model_set(block, "gamma", 0.4);
    model_set(block, "exponent", 1.5);
}

/* Triangles of many heights, not the same in both. */
static void record(recording_t *recording, const model_t *truth, const double *corner, size_t corners,
                   random_t *random) {
    recording_create(recording, "triangles", rate_hz, SAMPLES);
    fill_lines(recording->column[COLUMN_DRIVE], SAMPLES, corner, corners, 150);
    simulate_into(recording, truth, 0);
    for (size_t k = 0; k < SAMPLES; k++) {
        recording->column[COLUMN_DISPLACEMENT][k] += noise_um * random_normal(random);
    }
}

static void test_finds_the_model_in_triangles(void) {
    const double first[] = {50.0, 100.0, 0.0, 80.0, 20.0, 100.0, 40.0}, second[] = {10.0, 90.0, 30.0, 60.0, 0.0, 100.0};
    random_t random = random_start("Bouc-Wen fit", 1301);
    const fit_options_t options = {0};
    recording_t recording[RECORDINGS];
    fit_report_t report;
    hyst_parameters_t image;
    model_t truth, model;
    make_truth(&truth, -6.0);
    record(&recording[0], &truth, first, sizeof first / sizeof first[0], &random);
    record(&recording[1], &truth, second, sizeof second / sizeof second[0], &random);
    TEST_ASSERT_TRUE_MESSAGE(
        fit_recordings(&family_bouc_wen, recording, RECORDINGS, &options, &model, &report, &failure), failure.text);
    printf("held out %.4f %%, of which noise is %.4f %%\n", report.held_out_nrmse_percent, 100.0 * noise_um / 24.0);
    /* The stroke is some 24 um. Twice the noise: six numbers from 8000 samples add nothing that shows. */
    TEST_ASSERT_TRUE(report.held_out_nrmse_percent < 200.0 * noise_um / 20.0);
    /* Shape and sizes are strongly correlated, so the numbers themselves are judged by four of their own errors. */
    const char *const names[] = {"direct_um", "hysteretic_um", "beta", "gamma", "exponent"};
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        const parameter_t *found = model_parameter(&model.block[0], names[i]),
                          *true_one = model_parameter(&truth.block[0], names[i]);
        printf("%s %.4f +- %.4f, true %.4f\n", names[i], found->value[0], found->sigma[0], true_one->value[0]);
        TEST_ASSERT_TRUE(found->sigma[0] > 0.0 && found->sigma[0] < 0.1);
        TEST_ASSERT_DOUBLE_WITHIN(4.0 * found->sigma[0], true_one->value[0], found->value[0]);
    }
    TEST_ASSERT_TRUE_MESSAGE(compile_model(&model, &(compile_options_t){0}, &image, NULL, &failure), failure.text);
    TEST_ASSERT_EQUAL_UINT32(HYST_FAMILY_BOUC_WEN, image.family);
    fit_report_free(&report);
    model_free(&model);
    model_free(&truth);
    for (size_t i = 0; i < RECORDINGS; i++) {
        recording_free(&recording[i]);
    }
}

/* A loop of the other sense is none of a piezo's: what is fitted is a line, and it can be inverted. */
static void test_never_finds_what_cannot_be_inverted(void) {
    const double corner[] = {50.0, 100.0, 0.0, 80.0, 20.0, 100.0, 40.0}, too_much = -13.0;
    random_t random = random_start("Bouc-Wen sense", 1302);
    const fit_options_t options = {0};
    for (int i = 0; i < 2; i++) {
        recording_t recording;
        fit_report_t report;
        hyst_parameters_t image;
        model_t truth, model;
        make_truth(&truth, i == 0 ? 6.0 : too_much); /* the second one falls behind each reversal */
        record(&recording, &truth, corner, sizeof corner / sizeof corner[0], &random);
        TEST_ASSERT_TRUE_MESSAGE(fit_recordings(&family_bouc_wen, &recording, 1, &options, &model, &report, &failure),
                                 failure.text);
        TEST_ASSERT_TRUE(model_parameter(&model.block[0], "hysteretic_um")->value[0] <= 0.0);
        TEST_ASSERT_TRUE_MESSAGE(compile_model(&model, &(compile_options_t){0}, &image, NULL, &failure), failure.text);
        fit_report_free(&report);
        model_free(&model);
        model_free(&truth);
        recording_free(&recording);
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_finds_the_model_in_triangles);
    RUN_TEST(test_never_finds_what_cannot_be_inverted);
    return UNITY_END();
}
