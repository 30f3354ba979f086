/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Identification of the Preisach model: what it recovers, what it says it cannot, and what it does then. */
#include "chain/catalogue.h"
#include "compile/compile.h"
#include "elements/preisach_grid.h"
#include "identify/fit.h"
#include "support.h"
#include "unity.h"
#include <gsl/gsl_math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { INTERVALS = 8, LEVELS = INTERVALS + 1, ELEMENTS = LEVELS * INTERVALS / 2, RATE = 1000 };

static random_t rng;
static double level_v[LEVELS], table[ELEMENTS];

void setUp(void) {
}
void tearDown(void) {
}

/* The levels the family takes for a drive of 0 to 100 V, and relays whose weights differ from square to square. */
static void make_truth(model_t *model) {
    model_block_t *block;
    level_v[0] = 0.0;
    level_v[INTERVALS] = 100.0;
    for (size_t i = 1; i < INTERVALS; i++) {
        level_v[i] = 105.0 * (double)i / INTERVALS - 2.5;
    }
    for (size_t distance = 1; distance < LEVELS; distance++) {
        for (size_t j = 0; j + distance < LEVELS; j++) {
            const size_t i = j + distance;
            const double area = (level_v[i] - level_v[i - 1]) * (level_v[j + 1] - level_v[j]);
            double sum = distance == 1 ? (level_v[i] - level_v[j]) * (0.1 + 0.05 * random_unit(&rng))
                                       : area * 1e-3 * (0.2 + random_unit(&rng));
            if (distance > 1) {
                sum += table[preisach_element(i - 1, j)] + table[preisach_element(i, j + 1)];
                sum -= distance > 2 ? table[preisach_element(i - 1, j + 1)] : 0.0;
            }
            table[preisach_element(i, j)] = sum;
        }
    }
    model_create(model, RATE);
    block = model_append(model, &block_preisach);
    model_set_array(block, "levels_v", LEVELS, level_v, NULL);
    model_set_array(block, "everett_um", ELEMENTS, table, NULL);
    model_set(block, "offset_um", -2.0);
    model_set_array(block, "past_v", 1, (const double[]){0.0}, NULL);
}

/* First-order reversal curves: from the top down to ever lower reversals and back, `per_line` samples a line; then a
 * random walk between corners, which is what is held out. */
static void record_reversal_curves(recording_t *recording, const model_t *truth, size_t per_line, double noise_um) {
    enum { CURVES = 2 * INTERVALS, WALK = 17, CORNERS = 2 * CURVES + WALK };
    double corner[CORNERS];
    for (size_t k = 0; k < CURVES; k++) {
        corner[2 * k] = 100.0;
        corner[2 * k + 1] = 100.0 - 100.0 * (double)(k + 1) / CURVES;
    }
    for (size_t k = 0; k < WALK; k++) {
        corner[2 * CURVES + k] = 100.0 * random_unit(&rng);
    }
    recording_create(recording, "reversal curves", truth->sample_rate_hz, CORNERS * per_line);
    fill_lines(recording->column[COLUMN_DRIVE], recording->samples, corner, CORNERS, per_line);
    simulate_into(recording, truth, 1);
    for (size_t k = 0; k < recording->samples; k++) {
        recording->column[COLUMN_DISPLACEMENT][k] += noise_um * random_normal(&rng);
    }
}

static void fit_good(const recording_t *recordings, size_t count, size_t operators, model_t *model,
                     fit_report_t *report) {
    const fit_options_t options = {.operators = operators};
    failure_t failure = {{0}};
    TEST_ASSERT_TRUE_MESSAGE(
        fit_recordings(family_find("preisach"), recordings, count, &options, model, report, &failure), failure.text);
}

static const parameter_t *found(const model_t *model, const char *name) {
    return model_parameter(model_find(model, "preisach"), name);
}

static void test_recovers_the_table_from_reversal_curves(void) {
    recording_t recording;
    model_t truth, model;
    fit_report_t report;
    make_truth(&truth);
    record_reversal_curves(&recording, &truth, 97, 0.0);
    fit_good(&recording, 1, INTERVALS, &model, &report);
    for (size_t k = 0; k < LEVELS; k++) {
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, level_v[k], found(&model, "levels_v")->value[k]);
    }
    for (size_t k = 0; k < ELEMENTS; k++) {
        /* The smoothness weighs 1e-6 of the data and pulls at squares that differ by 0.2 um: 1e-5 of the range. */
        TEST_ASSERT_DOUBLE_WITHIN(2e-4, table[k], found(&model, "everett_um")->value[k]);
    }
    TEST_ASSERT_DOUBLE_WITHIN(1e-4, -2.0, found(&model, "offset_um")->value[0]);
    TEST_ASSERT_TRUE(report.held_out_nrmse_percent < 1e-3);
    TEST_ASSERT_EQUAL_INT(ELEMENTS, json_integer_value(json_object_get(model.fit, "determined_elements")));
    fit_report_free(&report);
    model_free(&model);
    model_free(&truth);
    recording_free(&recording);
}

/* Ever smaller swings about the middle, which `hyst record --waveform triangle` plays, reach every element too: from
 * the maximum above it or from the minimum below. */
static void test_shrinking_swings_determine_the_table(void) {
    enum { SWINGS = 20, AGAIN = 10, CORNERS = 2 * (SWINGS + AGAIN) };
    double corner[CORNERS];
    recording_t recording;
    model_t truth, model;
    fit_report_t report;
    make_truth(&truth);
    for (size_t k = 0; k < SWINGS + AGAIN; k++) { /* the first twenty are the training part, and the last ten alike */
        const double half = 50.0 * (1.0 - (k < SWINGS ? (double)k / SWINGS : (double)(k - SWINGS) / AGAIN));
        corner[2 * k] = 50.0 + half;
        corner[2 * k + 1] = 50.0 - half;
    }
    recording_create(&recording, "shrinking swings", RATE, CORNERS * 97);
    fill_lines(recording.column[COLUMN_DRIVE], recording.samples, corner, CORNERS, 97);
    simulate_into(&recording, &truth, 1);
    fit_good(&recording, 1, INTERVALS, &model, &report);
    TEST_ASSERT_EQUAL_INT(ELEMENTS, json_integer_value(json_object_get(model.fit, "determined_elements")));
    for (size_t k = 0; k < ELEMENTS; k++) {
        TEST_ASSERT_DOUBLE_WITHIN(1e-3, table[k], found(&model, "everett_um")->value[k]);
    }
    fit_report_free(&report);
    model_free(&model);
    model_free(&truth);
    recording_free(&recording);
}

/* Standard errors: the scatter over many noisy recordings is what they say. */
static void test_standard_errors_are_honest(void) {
    enum { RUNS = 12 };
    model_t truth;
    double squares = 0.0;
    make_truth(&truth);
    for (int run = 0; run < RUNS; run++) {
        recording_t recording;
        model_t model;
        fit_report_t report;
        record_reversal_curves(&recording, &truth, 97, 0.01);
        fit_good(&recording, 1, INTERVALS, &model, &report);
        for (size_t k = 0; k < ELEMENTS; k++) {
            const double error = found(&model, "everett_um")->value[k] - table[k];
            squares += gsl_pow_2(error / found(&model, "everett_um")->sigma[k]) / (RUNS * ELEMENTS);
        }
        fit_report_free(&report);
        model_free(&model);
        recording_free(&recording);
    }
    printf("errors in units of their standard error: %.3f rms\n", sqrt(squares));
    /* 1, but for the smoothness, which makes the scatter smaller and adds a bias. 432 errors, not independent. */
    TEST_ASSERT_TRUE(squares > gsl_pow_2(0.5) && squares < gsl_pow_2(1.4));
    model_free(&truth);
}

/*
 * One loop of a bank of plays, again and again, tells nothing about single relays. It says so, and what it fills in is
 * the bank: minor loops that it has never seen come out right.
 */
static void test_one_loop_becomes_prandtl_ishlinskii(void) {
    enum { PERIOD = 2000, PERIODS = 9 };
    static const double weights[] = {0.1, 0.02, 0.02, 0.015, 0.015}, thresholds[] = {5.0, 10.0, 20.0, 35.0};
    recording_t recording;
    model_t truth, model;
    fit_report_t report;
    make_bank_model(&truth, RATE, 1.0, 4, weights, thresholds);
    model_set_array(&truth.block[0], "initial_memory_v", 4, thresholds, NULL); /* at 0 V, coming from above */
    recording_create(&recording, "one loop", RATE, (size_t)PERIOD * PERIODS);
    for (size_t k = 0; k < recording.samples; k++) {
        const double turns = (double)k / PERIOD;
        const double minor = turns > 6.5 ? 0.35 * sin(6.0 * M_PI * turns) : 0.0;
        recording.column[COLUMN_DRIVE][k] =
            50.0 - 50.0 * (minor == 0.0 ? 1.0 : 0.6) * cos(2.0 * M_PI * turns) + 50.0 * minor;
    }
    simulate_into(&recording, &truth, 1);
    fit_good(&recording, 1, 0, &model, &report);
    printf("one loop: training %.4f %%, held out %.4f %%, %d of %zu elements determined\n", report.nrmse_percent,
           report.held_out_nrmse_percent, (int)json_integer_value(json_object_get(model.fit, "determined_elements")),
           found(&model, "everett_um")->count);
    /* A play's corner runs across the squares, where bilinear interpolation misses it by a quarter of its height there:
     * four plays with weights of 0.07 um/V together and intervals of 4 V, 0.14 um of some 12 um if they all met. */
    TEST_ASSERT_TRUE(report.held_out_nrmse_percent < 0.6); /* half of that, as they rarely meet */
    TEST_ASSERT_TRUE(report.nrmse_percent < 0.05);         /* the loop itself */
    TEST_ASSERT_TRUE(json_integer_value(json_object_get(model.fit, "determined_elements")) <
                     (json_int_t)found(&model, "everett_um")->count / 2);
    fit_report_free(&report);
    model_free(&model);
    model_free(&truth);
    recording_free(&recording);
}

/* A small recording with an unknown constant beside a large one: it adds what it knows and spoils nothing. */
static void test_recordings_of_different_size(void) {
    recording_t recordings[2];
    model_t truth, model;
    fit_report_t report;
    make_truth(&truth);
    record_reversal_curves(&recordings[0], &truth, 97, 0.0);
    recording_create(&recordings[1], "small", RATE, 3000);
    for (size_t k = 0; k < 3000; k++) {
        recordings[1].column[COLUMN_DRIVE][k] = 55.0 + (10.0 + 0.002 * (double)k) * sin(0.05 * (double)k);
    }
    simulate_into(&recordings[1], &truth, 1);
    for (size_t k = 0; k < 3000; k++) {
        recordings[1].column[COLUMN_DISPLACEMENT][k] += 0.7; /* another past */
    }
    fit_good(recordings, 2, INTERVALS, &model, &report);
    for (size_t k = 0; k < ELEMENTS; k++) {
        TEST_ASSERT_DOUBLE_WITHIN(1e-3, table[k], found(&model, "everett_um")->value[k]);
    }
    TEST_ASSERT_TRUE(report.recording[0].held_out_nrmse_percent < 1e-2);
    fit_report_free(&report);
    model_free(&model);
    model_free(&truth);
    recording_free(&recordings[0]);
    recording_free(&recordings[1]);
}

/* A start somewhere inside: the past is found from the samples that still depend on it. */
static void test_finds_the_past(void) {
    recording_t recording, cut;
    model_t truth, model;
    fit_report_t report;
    double position_um[400], worst = 0.0;
    failure_t failure = {{0}};
    make_truth(&truth);
    record_reversal_curves(&recording, &truth, 97, 0.0);
    /* 80 V, then 20 V, then 60 V before it begins; then a slow rise, and the curves. */
    recording_create(&cut, "cut", RATE, recording.samples + 400);
    for (size_t k = 0; k < cut.samples; k++) {
        cut.column[COLUMN_DRIVE][k] =
            k < 400 ? 60.0 + 0.1 * (double)k : recording.column[COLUMN_DRIVE][k - 400]; /* 60 to 100 V */
    }
    model_set_array(&truth.block[0], "past_v", 3, (const double[]){80.0, 20.0, 60.0}, NULL);
    simulate_into(&cut, &truth, 1);
    fit_good(&cut, 1, INTERVALS, &model, &report);
    cut.samples = 400;
    TEST_ASSERT_TRUE(chain_simulate(&model, &cut, 0, position_um, &failure));
    for (size_t k = 0; k < 400; k++) {
        worst = fmax(worst, fabs(position_um[k] - cut.column[COLUMN_DISPLACEMENT][k]));
    }
    printf("past: largest error before the memory is determined %.3g um\n", worst);
    TEST_ASSERT_TRUE(worst < 0.002); /* of some 15 um; the search stops at 1e-4 of the range */
    fit_report_free(&report);
    model_free(&model);
    model_free(&truth);
    recording_free(&recording);
    recording_free(&cut);
}

/* Creep behind relays: found beside the table, and worth it. */
static void test_creep_behind_the_relays(void) {
    recording_t recording;
    model_t truth, without, with_creep;
    fit_report_t report;
    const fit_options_t options = {.operators = INTERVALS, .creep = true};
    failure_t failure = {{0}};
    double error_without, gamma;
    make_truth(&truth);
    truth.sample_rate_hz = 20.0; /* reversal curves of 5 s a line */
    model_set(model_append(&truth, &block_creep), "gamma_per_decade", 0.02);
    record_reversal_curves(&recording, &truth, 97, 0.0);
    fit_good(&recording, 1, INTERVALS, &without, &report);
    error_without = report.held_out_nrmse_percent;
    fit_report_free(&report);
    TEST_ASSERT_TRUE_MESSAGE(
        fit_recordings(family_find("preisach"), &recording, 1, &options, &with_creep, &report, &failure), failure.text);
    TEST_ASSERT_NOT_NULL(model_find(&with_creep, "creep"));
    gamma = model_parameter(model_find(&with_creep, "creep"), "gamma_per_decade")->value[0];
    printf("creep: gamma %.4f (0.02), held out %.4f %%, without %.4f %%\n", gamma, report.held_out_nrmse_percent,
           error_without);
    TEST_ASSERT_DOUBLE_WITHIN(1e-4, 0.02, gamma); /* the search stops at 1e-6 */
    TEST_ASSERT_TRUE(report.held_out_nrmse_percent < 0.05 * error_without);
    fit_report_free(&report);
    model_free(&with_creep);
    model_free(&without);
    model_free(&truth);
    recording_free(&recording);
}

/* Largest error of the position behind the amplifier, from the reference, in um, over a sine with a smaller one on it.
 */
static double tracking_error(const hyst_compensator_t *amplifier, const hyst_parameters_t *parameters,
                             const model_t *truth, hyst_mode_t mode) {
    static hyst_compensator_state_t state;
    failure_t failure = {{0}};
    chain_t *actuator = chain_open(truth, RATE, 1, &failure);
    double worst = 0.0;
    unsigned events = 0;
    hyst_compensator_reset(amplifier, &state);
    chain_settle(actuator, 0.0);
    for (int k = 0; k < 400; k++) { /* conditioning: to both ends */
        const double volts = 100.0 - fabs(0.5 * (double)k - 100.0);
        const hyst_q31_t drive =
            hyst_compensator_step(amplifier, &state, HYST_MODE_DIRECT, drive_from_volts(parameters, volts), &events);
        chain_step(actuator, drive_to_volts(parameters, drive));
    }
    for (int k = 0; k < 3000; k++) {
        const double wanted_um = -2.0 + 4.0 * sin(0.01 * k) + 1.5 * sin(0.057 * k);
        const hyst_q31_t drive =
            hyst_compensator_step(amplifier, &state, mode, position_from_micrometres(parameters, wanted_um), &events);
        const double error = fabs(chain_step(actuator, drive_to_volts(parameters, drive)) - wanted_um);
        worst = k >= 200 ? fmax(worst, error) : worst; /* the transition is over by then */
    }
    chain_close(actuator);
    return worst;
}

/* The whole way: recorded, fitted, compiled, and the actuator behind the amplifier goes where it shall. */
static void test_fitted_and_compiled_it_linearises(void) {
    recording_t recording;
    model_t truth, model;
    fit_report_t report;
    const compile_options_t options = {0};
    hyst_parameters_t parameters;
    compile_report_t compiled;
    static hyst_compensator_t amplifier;
    failure_t failure = {{0}};
    double compensated_um, linear_um;
    make_truth(&truth);
    record_reversal_curves(&recording, &truth, 97, 0.001);
    fit_good(&recording, 1, INTERVALS, &model, &report);
    TEST_ASSERT_TRUE_MESSAGE(compile_model(&model, &options, &parameters, &compiled, &failure), failure.text);
    TEST_ASSERT_TRUE(compiled.merge_error_um < 1e-5); /* the fit's levels are the amplifier's */
    TEST_ASSERT_EQUAL_INT(HYST_PARAMETERS_OK, hyst_parameters_build(&parameters, &amplifier).error);
    compensated_um = tracking_error(&amplifier, &parameters, &truth, HYST_MODE_COMPENSATE);
    linear_um = tracking_error(&amplifier, &parameters, &truth, HYST_MODE_LINEAR);
    printf("largest tracking error %.4g um, %.4g um without the model\n", compensated_um, linear_um);
    /* 1 nm of noise in the recording. An element that only one curve sees has a standard error of 1.1 nm, and after the
     * first rise its error stands as a constant. */
    TEST_ASSERT_TRUE(compensated_um < 0.007);
    TEST_ASSERT_TRUE(linear_um > 0.5);
    fit_report_free(&report);
    model_free(&model);
    model_free(&truth);
    recording_free(&recording);
}

static void test_refuses_a_displacement_that_falls(void) {
    recording_t recording;
    model_t truth, model;
    fit_report_t report;
    failure_t failure = {{0}};
    const fit_options_t options = {0};
    make_truth(&truth);
    record_reversal_curves(&recording, &truth, 20, 0.0);
    for (size_t k = 0; k < recording.samples; k++) {
        recording.column[COLUMN_DISPLACEMENT][k] *= -1.0;
    }
    TEST_ASSERT_FALSE(fit_recordings(family_find("preisach"), &recording, 1, &options, &model, &report, &failure));
    expect_line(&failure, "turn the sign");
    model_free(&truth);
    recording_free(&recording);
}

int main(void) {
    rng = random_start("test_fit_preisach", 20261121);
    UNITY_BEGIN();
    RUN_TEST(test_recovers_the_table_from_reversal_curves);
    RUN_TEST(test_shrinking_swings_determine_the_table);
    RUN_TEST(test_standard_errors_are_honest);
    RUN_TEST(test_one_loop_becomes_prandtl_ishlinskii);
    RUN_TEST(test_recordings_of_different_size);
    RUN_TEST(test_finds_the_past);
    RUN_TEST(test_creep_behind_the_relays);
    RUN_TEST(test_fitted_and_compiled_it_linearises);
    RUN_TEST(test_refuses_a_displacement_that_falls);
    return UNITY_END();
}
