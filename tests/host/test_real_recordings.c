/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The recordings of real actuators, found through HYST_RECORDINGS; skipped without it. */
#include "compile/compile.h"
#include "identify/fit.h"
#include "support.h"
#include "unity.h"
#include <stdio.h>
#include <stdlib.h>

enum { SKIPPED = 77 };

static const char *folder;

void setUp(void) {
}
void tearDown(void) {
}

static void read_real(recording_t *recording, const char *name) {
    char path[4096];
    failure_t failure;
    snprintf(path, sizeof path, "%s/%s", folder, name);
    TEST_ASSERT_TRUE_MESSAGE(recording_read(recording, path, &failure), failure.text);
}

static void fit_real(const recording_t *recording, size_t operators, double worst_percent) {
    const fit_options_t options = {.operators = operators};
    const compile_options_t settings = {0};
    hyst_parameters_t parameters;
    compile_report_t compiled;
    model_t model;
    fit_report_t report;
    failure_t failure = {{0}};
    TEST_ASSERT_TRUE_MESSAGE(
        fit_recordings(&family_prandtl_ishlinskii, recording, 1, &options, &model, &report, &failure), failure.text);
    printf("%zu weights and offset: held out %.4f %%, training %.4f %%\n", report.parameters,
           report.held_out_nrmse_percent, report.nrmse_percent);
    TEST_ASSERT_TRUE(report.held_out_nrmse_percent < worst_percent);
    TEST_ASSERT_TRUE_MESSAGE(compile_model(&model, &settings, &parameters, &compiled, &failure), failure.text);
    TEST_ASSERT_TRUE(compiled.merge_error_um < 1e-3 * json_number_value(json_object_get(model.fit, "residual_rms_um")));
    model_free(&model);
    fit_report_free(&report);
}

/* 0.80 % on the last third is what the project promises; fixed thresholds, fitted to the first two thirds. */
static void test_stack_is_predicted_better_than_promised(void) {
    recording_t recording;
    read_real(&recording, "stack-p885-1hz.csv");
    fit_real(&recording, 0, 0.80);
    fit_real(&recording, 400, 0.80);
    recording_free(&recording);
}

/* At rest, a jump that rings, then a sine: neither the rest nor the ringing may spoil the fit. 0.5 % is some ten times
 * its noise. */
static void test_actuator_with_a_jump_is_fitted(void) {
    recording_t recording;
    read_real(&recording, "actuator-150v-1hz.csv");
    fit_real(&recording, 0, 0.5);
    fit_real(&recording, 400, 0.5);
    recording_free(&recording);
}

int main(void) {
    folder = getenv("HYST_RECORDINGS");
    if (folder == NULL || folder[0] == '\0') {
        puts("skipped: HYST_RECORDINGS is not set");
        return SKIPPED;
    }
    UNITY_BEGIN();
    RUN_TEST(test_stack_is_predicted_better_than_promised);
    RUN_TEST(test_actuator_with_a_jump_is_fitted);
    return UNITY_END();
}
