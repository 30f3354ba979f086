/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The recordings of real actuators, found through HYST_RECORDINGS; skipped without it. */
#include "compile/compile.h"
#include "identify/fit.h"
#include "interface/diagnosis_run.h"
#include "support.h"
#include "unity.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

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

static bool may_be(const finding_t *finding, const char *name) {
    bool is = strcmp(finding->block->name, name) == 0;
    for (size_t r = 0; r < finding->rivals; r++) {
        is = is || strcmp(finding->rival[r]->name, name) == 0;
    }
    return is;
}

/* One window of a recording of another simulator, where that is there. It creeps; a dielectric loss is found, which is
 * nearly the same. Beside weights that did without either the numbers of creep went astray, and it was not in the set:
 * 20 natural units less. Fitted together with the weights it is worth 11 more. */
static void test_creep_may_be_what_a_window_of_it_shows(void) {
    char path[4096];
    recording_t recording;
    diagnosis_run_t run;
    failure_t failure;
    bool creeps = false;
    snprintf(path, sizeof path, "%s/concealed/creep.csv", folder);
    FILE *there = fopen(path, "r");
    if (there == NULL) {
        TEST_IGNORE_MESSAGE("skipped: no such recording");
    }
    (void)fclose(there);
    read_real(&recording, "concealed/creep.csv");
    TEST_ASSERT_TRUE_MESSAGE(diagnosis_run(NULL, &recording, 1, 25000, &run, &failure), failure.text);
    for (size_t f = 0; f < run.answer.findings; f++) {
        creeps = creeps || may_be(&run.answer.finding[f], "creep");
    }
    TEST_ASSERT_TRUE(creeps);
    diagnosis_run_free(&run);
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
    if (!INSTRUMENTED) { /* a diagnosis, whose code other tests run */
        RUN_TEST(test_creep_may_be_what_a_window_of_it_shows);
    }
    return UNITY_END();
}
