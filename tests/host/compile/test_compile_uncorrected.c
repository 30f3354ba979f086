/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Compiling a chain with blocks that no amplifier can undo: the rest is undone, and the report names what is not. */
#include "chain/catalogue.h"
#include "compile/compile.h"
#include "support.h"
#include "unity.h"
#include <math.h>
#include <string.h>

void setUp(void) {
}
void tearDown(void) {
}

static model_t compiled_model(const block_t *block) {
    const double one = 0.1;
    model_t model;
    model_create(&model, 10000.0);
    if (block->place == PLACE_ELECTRONICS) {
        (void)model_append(&model, block);
    }
    model_set_array(model_append(&model, &block_prandtl_ishlinskii), "weights", 1, &one, NULL);
    if (block->place > PLACE_HYSTERESIS || block->follows_hysteresis) {
        (void)model_append(&model, block);
    }
    return model;
}

/* A sensor's curve is left alone only where the position shall follow. */
static const compile_options_t ranges = {
    .drive_range_v = {0.0, 100.0}, .position_range_um = {0.0, 10.0}, .follow_position = true};

/* The drive never asks for what the rails do not give. */
static void test_compiled_rails_limit_the_drive(void) {
    model_t model = compiled_model(&block_amplifier_saturation);
    hyst_parameters_t parameters;
    compile_report_t report;
    failure_t failure = {{0}};
    model_set(&model.block[0], "low_v", 20.0);
    model_set(&model.block[0], "high_v", 500.0);
    TEST_ASSERT_TRUE_MESSAGE(compile_model(&model, &ranges, &parameters, &report, &failure), failure.text);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 20.0, drive_to_volts(&parameters, parameters.drive_low));
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 20.0, drive_to_volts(&parameters, parameters.drive_park));
    TEST_ASSERT_EQUAL_INT32(HYST_Q31_MAX, parameters.drive_high);
    TEST_ASSERT_NOT_NULL(strstr(report.note[0], "limited to 20 to 100 V"));
    model_set(&model.block[0], "low_v", 101.0);
    TEST_ASSERT_FALSE(compile_model(&model, &ranges, &parameters, NULL, &failure));
    expect_line(&failure, "outside the rails at 101 and 500 V");
    model_set(&model.block[0], "low_v", 500.0);
    TEST_ASSERT_FALSE(compile_model(&model, &ranges, &parameters, NULL, &failure));
    expect_line(&failure, "low_v = 500 is not below high_v = 500");
    model_free(&model);
}

/* What has no inverse is said to have none, block by block, and the image is that of the model without it. */
static void test_compile_says_what_it_does_not_undo(void) {
    static const struct {
        const block_t *block;
        const char *name;
        double value;
        const char *name_2;
        double value_2;
        const char *why;
    } cases[] = {{&block_amplifier_slew_limit, "limit_v_per_s", 5000.0, NULL, 0.0, "moves by less than 5000 V/s"},
                 {&block_static_nonlinearity, "quadratic", 0.1, "half_range_um", 5.0, "the position follows"},
                 {&block_thermal_drift, "drift_um", 0.1, "time_constant_s", 5.0, "second sensor"},
                 {&block_mains_interference, "frequency_hz", 50.0, "amplitude_um", 0.1, "phase"},
                 {&block_sensor_noise, "rms_um", 0.1, NULL, 0.0, "on the reading"},
                 {&block_quantisation, "step_um", 0.1, NULL, 0.0, "on the reading"},
                 {&block_interleaved_hysteresis, "bilinear_gain", 0.01, "half_range_v", 50.0, "bilinear_gain of block"},
                 {&block_gain_drift, "gain_per_s", 0.1, NULL, 0.0, "does not know"},
                 {&block_self_heating, "time_constant_s", 5.0, "half_range_v", 50.0, "how warm"},
                 {&block_charge_leakage, "time_constant_s", 5.0, NULL, 0.0, "without bound"}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        model_t model = compiled_model(cases[i].block), bare;
        model_block_t *block = &model.block[cases[i].block->place == PLACE_ELECTRONICS ? 0 : 1];
        hyst_parameters_t parameters, without;
        compile_report_t report;
        failure_t failure = {{0}};
        model_set(block, cases[i].name, cases[i].value);
        if (cases[i].name_2 != NULL) {
            model_set(block, cases[i].name_2, cases[i].value_2);
        }
        TEST_ASSERT_TRUE_MESSAGE(compile_model(&model, &ranges, &parameters, &report, &failure), failure.text);
        TEST_ASSERT_EQUAL_UINT64(1, report.uncorrected);
        TEST_ASSERT_EQUAL_STRING(cases[i].block->name, report.uncorrected_block[0].block);
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(report.uncorrected_block[0].why, cases[i].why),
                                     report.uncorrected_block[0].why);
        model_copy(&bare, &model);
        model_remove(&bare, (size_t)(block - model.block));
        TEST_ASSERT_TRUE_MESSAGE(compile_model(&bare, &ranges, &without, &report, &failure), failure.text);
        TEST_ASSERT_EQUAL_UINT64(0, report.uncorrected);
        without.model_id = parameters.model_id;   /* all that may differ, */
        if (cases[i].block->follows_hysteresis) { /* and the straight line through all of its loop */
            without.linear_gain = parameters.linear_gain;
            without.linear_offset = parameters.linear_offset;
        }
        TEST_ASSERT_EQUAL_MEMORY_MESSAGE(&without, &parameters, sizeof parameters, cases[i].block->name);
        model_free(&bare);
        model_free(&model);
    }
}

/* A plane of relays is inverted as it is at a slow drive, and the report says what that leaves. */
static void test_compile_does_not_widen_a_plane(void) {
    const double level_v[] = {0.0, 50.0, 100.0}, table[] = {4.0, 10.0, 4.0};
    hyst_parameters_t parameters;
    compile_report_t report;
    failure_t failure = {{0}};
    model_t model;
    model_create(&model, 10000.0);
    model_set(model_append(&model, &block_rate_dependent_hysteresis), "beta_s", 1e-3);
    model_block_t *plane = model_append(&model, &block_preisach);
    model_set_array(plane, "levels_v", 3, level_v, NULL);
    model_set_array(plane, "everett_um", 3, table, NULL);
    model_set(plane, "offset_um", 5.0);
    TEST_ASSERT_TRUE_MESSAGE(compile_model(&model, &ranges, &parameters, &report, &failure), failure.text);
    TEST_ASSERT_EQUAL_INT32(0, parameters.pi_beta);
    TEST_ASSERT_EQUAL_UINT64(1, report.uncorrected);
    TEST_ASSERT_EQUAL_STRING("rate_dependent_hysteresis", report.uncorrected_block[0].block);
    TEST_ASSERT_NOT_NULL(strstr(report.uncorrected_block[0].why, "widens banks of plays, not planes of relays"));
    TEST_ASSERT_NOT_NULL(strstr(report.uncorrected_block[0].why, "stays in the position")); /* whole */
    model_free(&model);
}

/* Growth at the instant has no stable inverse: the amplifier's comes later, smoothed as far as that takes, and a note
 * says so. A model in the amplifier's own form is what it says, or refused. */
static void test_compile_smooths_a_growth_that_does_not_wait(void) {
    const double weights[] = {0.06, 0.02, 0.01}, thresholds_v[] = {5.0, 20.0}, part = 0.03 / 0.09;
    for (int i = 0; i < 3; i++) {
        const double beta_s = i == 0 ? 1e-4 : 1e-3, filter_s = i < 2 ? 0.0 : 2e-3;
        const double expected_s = i == 1 ? beta_s * part / 0.8 : filter_s;
        const double gain = expected_s > 0.0 ? 1.0 - exp(-1e-4 / expected_s) : 1.0;
        hyst_parameters_t parameters;
        compile_report_t report;
        failure_t failure = {{0}};
        model_t model;
        make_bank_model(&model, 10000.0, 0.0, 2, weights, thresholds_v);
        model_block_t *rate = model_append(&model, &block_rate_dependent_hysteresis);
        model_set(rate, "beta_s", beta_s);
        model_set(rate, "rate_filter_s", filter_s);
        model_set(rate, "immediate", 1.0);
        TEST_ASSERT_TRUE_MESSAGE(compile_model(&model, &ranges, &parameters, &report, &failure), failure.text);
        TEST_ASSERT_EQUAL_INT32((int32_t)floor(beta_s * 1e4 * 0x1p20 + 0.5), parameters.pi_beta);
        TEST_ASSERT_INT32_WITHIN(1, (int32_t)floor(gain * 0x1p30 + 0.5), parameters.pi_rate_gain);
        TEST_ASSERT_EQUAL_UINT64(1, report.notes);
        TEST_ASSERT_NOT_NULL(strstr(report.note[0], "one sample later than the model's"));
        model_set(rate, "immediate", 0.0);
        TEST_ASSERT_EQUAL(i != 1, compile_model(&model, &ranges, &parameters, &report, &failure));
        TEST_ASSERT_EQUAL_UINT64(1, report.notes);
        TEST_ASSERT_NOT_NULL(strstr(report.note[0], "grow as the model's"));
        model_free(&model);
    }
}

/* The chain that a diagnosis of a real set-up ends with: what can be undone is, in spite of what cannot. */
static void test_compile_undoes_the_rest_of_a_chain(void) {
    const double one = 0.1;
    hyst_parameters_t parameters;
    compile_report_t report;
    failure_t failure = {{0}};
    model_t model;
    model_create(&model, 1000.0);
    model_set(model_append(&model, &block_transport_delay), "delay_s", 0.003);
    model_set(model_append(&model, &block_amplifier_slew_limit), "limit_v_per_s", 5000.0);
    model_set(model_append(&model, &block_amplifier_saturation), "low_v", 10.0);
    model_set(&model.block[2], "high_v", 90.0);
    model_set_array(model_append(&model, &block_prandtl_ishlinskii), "weights", 1, &one, NULL);
    model_set(model_append(&model, &block_creep), "gamma_per_decade", 0.02);
    model_set(model_append(&model, &block_resonance), "frequency_hz", 100.0);
    model_set(&model.block[5], "damping_ratio", 0.1);
    model_set(model_append(&model, &block_thermal_drift), "drift_um", 0.1);
    model_set(&model.block[6], "time_constant_s", 5.0);
    model_set(model_append(&model, &block_mains_interference), "frequency_hz", 50.0);
    model_set(&model.block[7], "amplitude_um", 0.1);
    TEST_ASSERT_TRUE_MESSAGE(compile_model(&model, &ranges, &parameters, &report, &failure), failure.text);
    TEST_ASSERT_TRUE(parameters.lookahead_samples >= 3);
    TEST_ASSERT_TRUE(parameters.creep_cells > 0);
    TEST_ASSERT_TRUE(parameters.shape_sections > 0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 10.0, drive_to_volts(&parameters, parameters.drive_low));
    static const char *const left[] = {"mains_interference", "thermal_drift", "amplifier_saturation",
                                       "amplifier_slew_limit"}; /* against the signal, as it is undone */
    TEST_ASSERT_EQUAL_UINT64(4, report.uncorrected);
    for (size_t i = 0; i < 4; i++) {
        TEST_ASSERT_EQUAL_STRING(left[i], report.uncorrected_block[i].block);
    }
    model_free(&model);
}

/* Nobody adds a block whose fate in the amplifier is not said. */
static void test_every_block_is_undone_or_says_why_not(void) {
    for (size_t i = 0; i < catalogue_count; i++) {
        TEST_ASSERT_TRUE_MESSAGE((catalogue[i]->compile == NULL) == (catalogue[i]->uncorrected != NULL),
                                 catalogue[i]->name);
        TEST_ASSERT_FALSE_MESSAGE(block_is_hysteresis(catalogue[i]) && catalogue[i]->compile == NULL,
                                  catalogue[i]->name);
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_compiled_rails_limit_the_drive);
    RUN_TEST(test_compile_says_what_it_does_not_undo);
    RUN_TEST(test_compile_does_not_widen_a_plane);
    RUN_TEST(test_compile_smooths_a_growth_that_does_not_wait);
    RUN_TEST(test_compile_undoes_the_rest_of_a_chain);
    RUN_TEST(test_every_block_is_undone_or_says_why_not);
    return UNITY_END();
}
