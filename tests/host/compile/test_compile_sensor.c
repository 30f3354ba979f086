/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Compiling a chain that ends in a curved sensor: the reading follows the reference, or the position does. */
#include "chain/catalogue.h"
#include "chain/chain.h"
#include "compile/compile.h"
#include "support.h"
#include "unity.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void setUp(void) {
}
void tearDown(void) {
}

static const double rate_hz = 10000.0;
static const double half_um = 50.0; /* of the range that the sensor's numbers belong to, around 0 */

typedef struct {
    double quadratic, cubic;
} sensor_t;

/* Three play operators that move by 0.48 to 0.6 um/V within 0 to 200 V: positions of -60 to 60 um. */
static void make_model(model_t *model, const sensor_t *sensor) {
    const double weights[] = {0.48, 0.06, 0.03, 0.03}, thresholds[] = {4.0, 12.0, 30.0};
    make_bank_model(model, rate_hz, -60.0, 3, weights, thresholds);
    if (sensor != NULL) {
        model_block_t *block = model_append(model, &block_static_nonlinearity);
        model_set(block, "quadratic", sensor->quadratic);
        model_set(block, "cubic", sensor->cubic);
        model_set(block, "half_range_um", half_um);
    }
}

static const compile_options_t ranges = {.drive_range_v = {-20.0, 220.0}, .position_range_um = {-60.0, 70.0}};

static void compile_good(const model_t *model, const compile_options_t *options, hyst_parameters_t *parameters,
                         compile_report_t *report) {
    failure_t failure = {{0}};
    TEST_ASSERT_TRUE_MESSAGE(compile_model(model, options, parameters, report, &failure), failure.text);
}

typedef struct {
    double worst_um, rms_um;
} error_t;

/* Between a slow reference over +-amplitude and what the chain makes of the compensator's drive. */
static error_t error_of(const hyst_parameters_t *p, const model_t *plant, hyst_mode_t mode, double amplitude_um) {
    enum { SAMPLES = 40000, COUNTED = 20000 };
    static hyst_compensator_t compensator;
    static hyst_compensator_state_t state;
    failure_t failure;
    chain_t *chain = chain_open(plant, rate_hz, 1, &failure);
    error_t error = {0};
    TEST_ASSERT_NOT_NULL(chain);
    TEST_ASSERT_EQUAL_INT(HYST_PARAMETERS_OK, hyst_parameters_build(p, &compensator).error);
    hyst_compensator_reset(&compensator, &state);
    chain_settle(chain, drive_to_volts(p, p->drive_park));
    for (int k = 0; k < SAMPLES; k++) {
        const double swept = fmin(1.0, 4.0 * k / SAMPLES); /* what it erases first need not agree */
        const double wanted_um = amplitude_um * swept * sin(0.002 * k);
        unsigned events;
        const hyst_q31_t drive =
            hyst_compensator_step(&compensator, &state, mode, position_from_micrometres(p, wanted_um), &events);
        const double off_um = chain_step(chain, drive_to_volts(p, drive)) - wanted_um;
        if (k >= SAMPLES - COUNTED) {
            error.worst_um = fmax(error.worst_um, fabs(off_um));
            error.rms_um += off_um * off_um / COUNTED;
        }
    }
    chain_close(chain);
    error.rms_um = sqrt(error.rms_um);
    return error;
}

static double worst_error_um(const hyst_parameters_t *p, const model_t *plant) {
    return error_of(p, plant, HYST_MODE_COMPENSATE, 45.0).worst_um;
}

static void expect_note(const compile_report_t *report, const char *text) {
    TEST_ASSERT_EQUAL_UINT64(1, report->notes);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(report->note[0], text), report->note[0]);
}

/*
 * The bound of the curve: chords of its inverse, whose curvature is at most |C''| / C'^3, over a 32nd of the range,
 * times the sensor's slope, and 1e-6 um for the rounding of a bank of four weights to Q28 (8 * 2^-29 of the range).
 */
static void test_the_reading_follows_the_reference(void) {
    random_t random = random_start("curved sensors", 31);
    double worst_part = 0.0;
    for (int turn = 0; turn < 40; turn++) {
        const sensor_t sensor = {0.2 * (random_unit(&random) - 0.5), 0.1 * (random_unit(&random) - 0.5)};
        const double bend = 2.0 * fabs(sensor.quadratic) + 3.0 * fabs(sensor.cubic); /* of the slope */
        const double curvature =
            2.0 * (fabs(sensor.quadratic) + 3.0 * fabs(sensor.cubic)) / pow(1.0 - bend, 3.0) / half_um;
        const double step_um = 130.0 / HYST_CURVE_INTERVALS;
        const double bound = (1.0 + bend) * curvature * step_um * step_um / 8.0 + 1e-6;
        hyst_parameters_t parameters;
        compile_report_t report;
        model_t model;
        make_model(&model, &sensor);
        compile_good(&model, &ranges, &parameters, &report);
        TEST_ASSERT_EQUAL_UINT32(1, parameters.reference_curves);
        TEST_ASSERT_EQUAL_UINT64(0, report.uncorrected);
        expect_note(&report, "the reading follows the reference");
        const double error = worst_error_um(&parameters, &model);
        const double noted = strtod(strstr(report.note[0], ", to ") + 5, NULL);
        TEST_ASSERT_TRUE(error <= 1.05 * noted + 1e-6); /* two digits of it */
        worst_part = fmax(worst_part, error / bound);
        TEST_ASSERT_TRUE(error <= bound);
        model_free(&model);
    }
    printf("largest error: %.2f of its bound\n", worst_part);
    TEST_ASSERT_TRUE(worst_part > 0.2); /* it is the chords' */
}

/* The image is that of the model without the sensor: the position follows, and the reading is off by the curve. */
static void test_or_the_position_does(void) {
    const sensor_t sensor = {0.03, -0.02};
    compile_options_t options = ranges;
    hyst_parameters_t parameters, without;
    compile_report_t report;
    model_t model, bare;
    options.follow_position = true;
    make_model(&model, &sensor);
    make_model(&bare, NULL);
    compile_good(&model, &options, &parameters, &report);
    TEST_ASSERT_EQUAL_UINT64(1, report.uncorrected);
    TEST_ASSERT_EQUAL_STRING("static_nonlinearity", report.uncorrected_block[0].block);
    TEST_ASSERT_EQUAL_UINT64(0, report.notes);
    compile_good(&bare, &options, &without, NULL);
    without.model_id = parameters.model_id;
    TEST_ASSERT_EQUAL_MEMORY(&without, &parameters, sizeof parameters);
    TEST_ASSERT_TRUE(worst_error_um(&parameters, &bare) < 1e-6);
    /* At s = -0.9 the sensor adds 0.03 * 0.81 + 0.02 * 0.729 of 50 um. */
    TEST_ASSERT_DOUBLE_WITHIN(0.01, 50.0 * (0.03 * 0.81 + 0.02 * 0.729), worst_error_um(&parameters, &model));
    model_free(&bare);
    model_free(&model);
}

/* Linear mode is the best straight line for what follows, over the drive's range: through readings it leaves less of
 * them than a line through positions does, which is off by the mean of the curve besides: without it s^2 has two thirds
 * of its rms, and the hysteresis is in both. */
static void test_the_straight_line_is_drawn_through_readings(void) {
    const sensor_t sensor = {0.06, 0.0};
    const compile_options_t reading = {.drive_range_v = {0.0, 200.0}, .position_range_um = {-70.0, 80.0}};
    compile_options_t position = reading;
    hyst_parameters_t parameters;
    model_t model;
    position.follow_position = true;
    make_model(&model, &sensor);
    compile_good(&model, &position, &parameters, NULL);
    const double ignored_um = error_of(&parameters, &model, HYST_MODE_LINEAR, 55.0).rms_um;
    compile_good(&model, &reading, &parameters, NULL);
    const double drawn_um = error_of(&parameters, &model, HYST_MODE_LINEAR, 55.0).rms_um;
    printf("straight line: %.3f um rms of the readings through positions, %.3f um through readings\n", ignored_um,
           drawn_um);
    TEST_ASSERT_TRUE(drawn_um < 0.8 * ignored_um);
    model_free(&model);
}

/* The sensor's curve stands behind the load: the reading is undone first, then the stroke that the force costs. */
static void test_through_a_preload(void) {
    const sensor_t sensor = {0.05, 0.02};
    hyst_parameters_t parameters;
    compile_report_t report;
    model_t model, bare;
    make_model(&bare, NULL);
    model_block_t *preload = model_append(&bare, &block_preload);
    model_set(preload, "force_n", 10.0);
    model_set(preload, "compliance_per_n", 0.01);
    model_copy(&model, &bare);
    model_block_t *block = model_append(&model, &block_static_nonlinearity);
    model_set(block, "quadratic", sensor.quadratic);
    model_set(block, "cubic", sensor.cubic);
    model_set(block, "half_range_um", half_um);
    compile_good(&model, &ranges, &parameters, &report);
    TEST_ASSERT_TRUE(worst_error_um(&parameters, &model) < 0.01);
    model_free(&bare);
    model_free(&model);
}

/* What track takes its range from: the reference for a position, within the converter's range. */
static void test_the_reference_for_a_position(void) {
    const sensor_t sensor = {0.05, 0.02};
    hyst_parameters_t parameters;
    model_t model;
    make_model(&model, &sensor);
    compile_good(&model, &ranges, &parameters, NULL);
    for (int i = -99; i <= 99; i++) {
        const hyst_q31_t reference = (hyst_q31_t)lround(0x1p31 * reference_for(&parameters, i / 100.0));
        /* Half a unit of the reference, times the curve's slope, which is below 2, and half one of the position. */
        TEST_ASSERT_DOUBLE_WITHIN(1.5, i / 100.0 * 0x1p31, hyst_curve_apply(parameters.reference_curve, reference));
    }
    TEST_ASSERT_EQUAL_DOUBLE(-1.0, reference_for(&parameters, -1.5));
    TEST_ASSERT_EQUAL_DOUBLE(1.0 - 0x1p-31, reference_for(&parameters, 1.5));
    parameters.reference_curves = 0;
    TEST_ASSERT_EQUAL_DOUBLE(1.5, reference_for(&parameters, 1.5));
    model_free(&model);
}

static void test_one_curve_at_each_end(void) {
    const sensor_t sensor = {0.05, 0.02};
    const double one = 0.5;
    hyst_parameters_t parameters;
    failure_t failure = {{0}};
    model_t model;
    make_model(&model, &sensor);
    model_set(model_append(&model, &block_static_nonlinearity), "half_range_um", half_um);
    TEST_ASSERT_FALSE(compile_model(&model, &ranges, &parameters, NULL, &failure));
    expect_line(&failure, "block static_nonlinearity: the amplifier has no second reference curve");
    model_set(&model.block[1], "cubic", -0.5);
    TEST_ASSERT_FALSE(compile_model(&model, &ranges, &parameters, NULL, &failure));
    expect_line(&failure, "the reading falls within the range");
    model_free(&model);
    model_create(&model, rate_hz);
    for (int i = 0; i < 2; i++) {
        model_set(model_append(&model, &block_asymmetric_hysteresis), "half_range_v", 100.0);
    }
    model_set_array(model_append(&model, &block_prandtl_ishlinskii), "weights", 1, &one, NULL);
    TEST_ASSERT_FALSE(compile_model(&model, &ranges, &parameters, NULL, &failure));
    expect_line(&failure, "block asymmetric_hysteresis: the amplifier has no second drive curve");
    model_free(&model);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_the_reading_follows_the_reference);
    RUN_TEST(test_or_the_position_does);
    RUN_TEST(test_the_straight_line_is_drawn_through_readings);
    RUN_TEST(test_through_a_preload);
    RUN_TEST(test_the_reference_for_a_position);
    RUN_TEST(test_one_curve_at_each_end);
    return UNITY_END();
}
