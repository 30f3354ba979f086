/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Block and family `ellipse`: the block against loops from an independent generator, its inverse against the block. */
#include "chain/catalogue.h"
#include "compile/compile.h"
#include "elements/phaser.h"
#include "ellipses_003.h"
#include "hyst/compensator.h"
#include "identify/fit.h"
#include "numerics/sine_fit.h"
#include "support.h"
#include "unity.h"
#include <gsl/gsl_math.h>
#include <stdio.h>
#include <stdlib.h>

static random_t rng;

void setUp(void) {
}
void tearDown(void) {
}

static void table_model(model_t *model, size_t rows) {
    double column[6][ELLIPSES_003];
    static const char *const names[] = {"frequencies_hz", "x_center", "y_center", "major", "minor", "angle_rad"};
    model_create(model, 10000.0);
    model_block_t *block = model_append(model, &block_ellipse);
    for (size_t i = 0; i < rows; i++) {
        const ellipse_003_t *row = &ellipses_003[i + ELLIPSES_003 - rows];
        const double values[] = {row->frequency_hz, row->x_center, row->y_center, row->major, row->minor, row->angle};
        for (size_t c = 0; c < 6; c++) {
            column[c][i] = values[c];
        }
    }
    for (size_t c = 0; c < 6; c++) {
        model_set_array(block, names[c], rows, column[c], NULL);
    }
    model_set(block, "drive_range_v", 150.0);
    model_set(block, "displacement_range_um", 90.0);
}

/* The block finds the frequency by itself and then draws the rebuilt loop. */
static void test_the_block_draws_every_ellipse_of_the_table(void) {
    model_t model;
    failure_t failure;
    double worst = 0.0;
    table_model(&model, ELLIPSES_003);
    for (size_t i = 0; i < ELLIPSES_003; i++) {
        const double period = 10000.0 / ellipses_003[i].frequency_hz;
        chain_t *chain = chain_open(&model, 10000.0, 1, &failure);
        TEST_ASSERT_NOT_NULL_MESSAGE(chain, failure.text);
        for (int k = 0; k < (int)(4.0 * period); k++) {
            double drive_v, expected, found;
            ellipse_003_point(&ellipses_003[i], 2.0 * M_PI * k / period, &drive_v, &expected);
            found = k == 0 ? chain_settle(chain, drive_v) : chain_step(chain, drive_v);
            if (k > (int)(2.0 * period)) {
                worst = fmax(worst, fabs(found - expected));
            }
        }
        chain_close(chain);
    }
    printf("block against the rebuilt loops: %.2g um at most\n", worst);
    /* A passage of 300 Hz (33 samples a period) is interpolated to (0.19 rad)^3 / 16 of a radian = 4e-4 of a sample's
     * angle: 1e-3 of an amplitude of 5.5 um through a lag of 0.7 rad would be 0.004 um. */
    TEST_ASSERT_TRUE(worst < 0.004);
    model_free(&model);
}

/* With one frequency in the table nothing has to be measured, and the block is exact. */
static void test_one_ellipse_is_exact(void) {
    model_t model;
    failure_t failure;
    table_model(&model, 1);
    chain_t *chain = chain_open(&model, 10000.0, 1, &failure);
    TEST_ASSERT_NOT_NULL_MESSAGE(chain, failure.text);
    for (int k = 0; k < 1000; k++) {
        double drive_v, expected;
        ellipse_003_point(&ellipses_003[8], 2.0 * M_PI * 300.0 * k / 10000.0, &drive_v, &expected);
        const double found = k == 0 ? chain_settle(chain, drive_v) : chain_step(chain, drive_v);
        if (k > 40) { /* the lag's 4 samples of the past */
            TEST_ASSERT_DOUBLE_WITHIN(1e-9, expected, found);
        }
    }
    chain_close(chain);
    model_free(&model);
}

/* Whatever the drive does, and at any sample rate, the output is a past drive (or, between two samples, a sine through
 * them, of four samples a period or more: no higher than 1 / cos(pi / 4) times the higher one) times a gain of the
 * table.
 */
static void test_any_drive_stays_within_the_gain(void) {
    for (int run = 0; run < 300; run++) {
        const double rate_hz = exp(log(50.0) + log(1e4) * random_unit(&rng)); /* 50 Hz to 500 kHz */
        const int kind = random_between(&rng, 0, 3);
        double largest_v = 0.0, u = 75.0;
        model_t model;
        failure_t failure;
        table_model(&model, (size_t)random_between(&rng, 1, ELLIPSES_003));
        chain_t *chain = chain_open(&model, rate_hz, 1, &failure);
        TEST_ASSERT_NOT_NULL_MESSAGE(chain, failure.text);
        chain_settle(chain, u);
        for (int k = 0; k < 3000; k++) {
            switch (kind) {
            case 0:
                u = 150.0 * random_unit(&rng); /* noise */
                break;
            case 1:
                u = k % 700 < 350 ? 60.0 : 110.0; /* steps */
                break;
            case 2:
                u += 2.0 * random_unit(&rng) - 1.0; /* a walk */
                break;
            default:
                u = 75.0 + 0.01 * k * sin(1e-6 * k * k); /* faster and larger */
                break;
            }
            largest_v = fmax(largest_v, fabs(u - 75.0) + 0.5); /* centres: 74.70 to 74.85 V */
            const double position = chain_step(chain, u);
            /* 0.40 um/V is the largest gain; centres are at 51.48 to 51.57 um */
            TEST_ASSERT_TRUE(fabs(position - 51.5) <= 0.402 * 1.4143 * largest_v + 0.1);
        }
        chain_close(chain);
        model_free(&model);
    }
}

static void test_between_frequencies_nothing_overshoots(void) {
    phaser_row_t rows[ELLIPSES_003];
    for (size_t i = 0; i < ELLIPSES_003; i++) {
        const ellipse_003_t *r = &ellipses_003[i];
        const ellipse_t ellipse = {r->x_center, r->y_center, r->major, r->minor, r->angle};
        rows[i] = phaser_row(r->frequency_hz, &ellipse, 150.0, 90.0);
    }
    for (size_t i = 0; i < ELLIPSES_003; i++) {
        const phaser_t at = phaser_at(rows, ELLIPSES_003, ellipses_003[i].frequency_hz);
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, exp(rows[i].column[PHASER_LOG_GAIN]), at.gain);
        if (i + 1 < ELLIPSES_003) {
            const double low = fmin(rows[i].column[PHASER_LAG], rows[i + 1].column[PHASER_LAG]);
            const double high = fmax(rows[i].column[PHASER_LAG], rows[i + 1].column[PHASER_LAG]);
            for (int step = 0; step <= 100; step++) {
                const double f = ellipses_003[i].frequency_hz *
                                 pow(ellipses_003[i + 1].frequency_hz / ellipses_003[i].frequency_hz, step / 100.0);
                const double lag = 2.0 * M_PI * f * phaser_at(rows, ELLIPSES_003, f).lag_s;
                TEST_ASSERT_TRUE(lag >= low - 1e-12 && lag <= high + 1e-12);
            }
        }
    }
    /* Outside: the nearest one's. */
    TEST_ASSERT_EQUAL_DOUBLE(phaser_at(rows, ELLIPSES_003, 0.5).lag_s, phaser_at(rows, ELLIPSES_003, 0.01).lag_s);
    TEST_ASSERT_EQUAL_DOUBLE(phaser_at(rows, ELLIPSES_003, 300.0).gain, phaser_at(rows, ELLIPSES_003, 4e3).gain);
}

/* What the amplifier runs, against the model it was compiled from: the position is the reference, `lookahead` later. */
static void test_the_inverse_phaser_undoes_the_block(void) {
    static const double frequencies[] = {10.0, 33.0, 100.0, 200.0, 287.0};
    model_t model;
    failure_t failure = {{0}};
    table_model(&model, ELLIPSES_003);
    for (size_t f = 0; f < sizeof frequencies / sizeof frequencies[0]; f++) {
        const compile_options_t options = {
            .frequency_hz = frequencies[f], .drive_range_v = {0.0, 150.0}, .position_range_um = {0.0, 100.0}};
        hyst_parameters_t parameters;
        hyst_compensator_t compensator;
        hyst_compensator_state_t state;
        double worst = 0.0;
        unsigned events;
        TEST_ASSERT_TRUE_MESSAGE(compile_model(&model, &options, &parameters, NULL, &failure), failure.text);
        TEST_ASSERT_EQUAL_INT(HYST_PARAMETERS_OK, hyst_parameters_build(&parameters, &compensator).error);
        hyst_compensator_reset(&compensator, &state);
        chain_t *chain = chain_open(&model, 10000.0, 1, &failure);
        chain_settle(chain, 75.0);
        for (int k = 0; k < 8000; k++) {
            const double angle = 2.0 * M_PI * frequencies[f] / 10000.0;
            const double reference = 51.5 + 5.0 * sin(angle * k);
            const double ahead = 51.5 + 5.0 * sin(angle * (k + (int)parameters.lookahead_samples));
            const hyst_q31_t drive = hyst_compensator_step(&compensator, &state, HYST_MODE_COMPENSATE,
                                                           position_from_micrometres(&parameters, ahead), &events);
            const double position = chain_step(chain, drive_to_volts(&parameters, drive));
            if (k > 4000) {
                worst = fmax(worst, fabs(position - reference));
            }
        }
        printf("inverse phaser at %g Hz: %.2g um at most\n", frequencies[f], worst);
        /* The wait within a sample interpolates linearly, which costs up to 1 - cos(angle / 2) of the amplitude; the
         * frequency is measured (see above). */
        TEST_ASSERT_TRUE(worst < 5.0 * (1.0 - cos(M_PI * frequencies[f] / 10000.0)) + 0.004);
        chain_close(chain);
    }
    model_free(&model);
}

static void expect_no_image(const model_t *model, double frequency_hz, const char *text) {
    const compile_options_t options = {
        .frequency_hz = frequency_hz, .drive_range_v = {0.0, 150.0}, .position_range_um = {0.0, 100.0}};
    hyst_parameters_t parameters;
    failure_t failure;
    TEST_ASSERT_FALSE(compile_model(model, &options, &parameters, NULL, &failure));
    expect_line(&failure, text);
}

static void test_no_image_for_a_frequency_that_is_not_known(void) {
    model_t model;
    table_model(&model, ELLIPSES_003);
    expect_no_image(&model, 0.0, "give --frequency, 0.5 to 300 Hz");
    expect_no_image(&model, 310.0, "nothing is known at 310 Hz, only from 0.5 to 300 Hz");
    expect_no_image(&model, 1.0, "the amplifier looks ahead at most 63"); /* 0.117 rad of 1 Hz are 187 samples */
    model_free(&model);
}

static void test_tables_that_make_no_sense_are_refused(void) {
    static const struct {
        const char *parameter;
        double value[2];
        size_t count;
        const char *says;
    } cases[] = {
        {"frequencies_hz", {2.0, 1.0}, 2, "does not rise"}, {"major", {0.1, 0.001}, 2, "smaller than minor[1]"},
        {"angle_rad", {0.5, 0.0}, 2, "angle_rad[1]"},       {"x_center", {0.5}, 1, "1 values of x_center"},
        {"halves_hz", {1.0}, 1, "0 numbers of ascending"},  {"minor", {0.01, -1.0}, 2, "minor"},
        {"frequencies_hz", {0.0, 1.0}, 0, "frequencies_hz"}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        model_t model;
        failure_t failure = {{0}};
        table_model(&model, 2);
        model_set_array(&model.block[0], cases[i].parameter, cases[i].count, cases[i].value, NULL);
        TEST_ASSERT_FALSE_MESSAGE(model_check(&model, "model", &failure), cases[i].says);
        expect_line(&failure, cases[i].says);
        model_free(&model);
    }
}

/* One second of a loop rebuilt from the table, with 10 nm of noise. */
static void rebuilt_recording(recording_t *recording, const ellipse_003_t *row) {
    recording_create(recording, "rebuilt", 10000.0, 10000);
    for (size_t k = 0; k < recording->samples; k++) {
        ellipse_003_point(row, 2.0 * M_PI * row->frequency_hz * (double)k / 10000.0,
                          &recording->column[COLUMN_DRIVE][k], &recording->column[COLUMN_DISPLACEMENT][k]);
        recording->column[COLUMN_DISPLACEMENT][k] += 0.01 * random_normal(&rng);
    }
}

static void test_the_family_finds_the_table_again(void) {
    static const size_t rows[] = {8, 4, 6}; /* in no order */
    recording_t recordings[3];
    model_t model;
    fit_report_t report;
    failure_t failure = {{0}};
    const fit_options_t options = {0};
    for (size_t i = 0; i < 3; i++) {
        rebuilt_recording(&recordings[i], &ellipses_003[rows[i]]);
    }
    /* Their amplitudes differ by 4 %, as the tips of the measured loops were cut: not one table. */
    TEST_ASSERT_FALSE(fit_recordings(&family_ellipse, recordings, 3, &options, &model, &report, &failure));
    expect_line(&failure, "one amplitude about one bias");
    for (size_t i = 0; i < 3; i++) { /* the ellipse scaled in the direction of the drive, to 15 V */
        const double amplitude = ellipses_003[rows[i]].frequency_hz;
        sine_t sine;
        TEST_ASSERT_TRUE(sine_fit_at(recordings[i].column[COLUMN_DRIVE], 10000, 10000.0, amplitude, &sine, &failure));
        for (size_t k = 0; k < recordings[i].samples; k++) {
            double *drive = &recordings[i].column[COLUMN_DRIVE][k];
            *drive = 75.0 + 15.0 / sine.amplitude * (*drive - sine.offset);
        }
    }
    TEST_ASSERT_TRUE_MESSAGE(fit_recordings(&family_ellipse, recordings, 3, &options, &model, &report, &failure),
                             failure.text);
    /* The noise is 0.09 % of the 11 um that the loops are high. */
    TEST_ASSERT_TRUE(report.held_out_nrmse_percent < 0.1);
    for (size_t i = 0; i < 3; i++) {
        static const size_t place[] = {2, 0, 1};
        const ellipse_003_t *r = &ellipses_003[rows[i]];
        const ellipse_t truth = {r->x_center, r->y_center, r->major, r->minor, r->angle};
        const ellipse_sines_t sines = ellipse_sines(&truth);
        const double *major = model_parameter(&model.block[0], "major")->value;
        const ellipse_t found = {.major = major[place[i]],
                                 .minor = model_parameter(&model.block[0], "minor")->value[place[i]],
                                 .angle = model_parameter(&model.block[0], "angle_rad")->value[place[i]]};
        TEST_ASSERT_DOUBLE_WITHIN(1e-6, r->frequency_hz,
                                  model_parameter(&model.block[0], "frequencies_hz")->value[place[i]]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-3, sines.lag, ellipse_sines(&found).lag);
    }
    TEST_ASSERT_EQUAL_UINT64(0, model_parameter(&model.block[0], "halves_hz")->count); /* nothing sharp there */
    model_free(&model);
    fit_report_free(&report);
    for (size_t i = 0; i < 3; i++) {
        recording_free(&recordings[i]);
    }
}

/* A play bank has the sharp tips that an ellipse cuts. */
static void sharp_recording(recording_t *recording, bool triangle) {
    enum { PLAYS = 40 };
    double weights[PLAYS + 1] = {0.3}, thresholds[PLAYS];
    model_t truth;
    for (size_t i = 0; i < PLAYS; i++) {
        thresholds[i] = 0.5 * (double)(i + 1);
        weights[i + 1] = 0.01;
    }
    make_bank_model(&truth, 1000.0, 10.0, PLAYS, weights, thresholds);
    recording_create(recording, triangle ? "triangle" : "sharp", 1000.0, 6000);
    for (size_t k = 0; k < recording->samples; k++) {
        const double s = sin(2.0 * M_PI * (double)k / 1000.0);
        recording->column[COLUMN_DRIVE][k] = 75.0 + 15.0 * (triangle ? 2.0 / M_PI * asin(s) : s);
    }
    simulate_into(recording, &truth, 1);
    model_free(&truth);
}

static void test_halves_have_the_sharp_tips(void) {
    recording_t recording;
    model_t model;
    fit_report_t report;
    failure_t failure = {{0}};
    const fit_options_t options = {0};
    sharp_recording(&recording, false);
    TEST_ASSERT_TRUE_MESSAGE(fit_recordings(&family_ellipse, &recording, 1, &options, &model, &report, &failure),
                             failure.text);
    const double halves = report.held_out_nrmse_percent;
    TEST_ASSERT_EQUAL_UINT64(1, model_parameter(&model.block[0], "halves_hz")->count);
    for (int p = 8; p < 11; p++) { /* the same model without its halves */
        model_set_array(&model.block[0], model.block[0].block->parameter[p].name, 0, NULL, NULL);
    }
    double *position = allocate(recording.samples, sizeof(double));
    TEST_ASSERT_TRUE(chain_simulate(&model, &recording, 1, position, &failure));
    const double single =
        measure_error(recording.column[COLUMN_DISPLACEMENT] + 4000, position + 4000, 2000).nrmse_percent;
    printf("sharp loop, held out: halves %.3f %%, one ellipse %.3f %%\n", halves, single);
    TEST_ASSERT_TRUE(halves < 0.5 * single);
    free(position);
    model_free(&model);
    fit_report_free(&report);
    recording_free(&recording);
}

static void test_the_family_says_what_it_needs(void) {
    recording_t recordings[2];
    model_t model;
    fit_report_t report;
    failure_t failure = {{0}};
    const fit_options_t options = {0};
    sharp_recording(&recordings[0], true);
    TEST_ASSERT_FALSE(fit_recordings(&family_ellipse, recordings, 1, &options, &model, &report, &failure));
    expect_line(&failure, "triangle: family ellipse needs a sinusoidal drive");
    recording_free(&recordings[0]);
    sharp_recording(&recordings[0], false);
    sharp_recording(&recordings[1], false);
    TEST_ASSERT_FALSE(fit_recordings(&family_ellipse, recordings, 2, &options, &model, &report, &failure));
    expect_line(&failure, "one recording a frequency");
    recordings[0].samples = 1000; /* two thirds of it are less than a period */
    TEST_ASSERT_FALSE(fit_recordings(&family_ellipse, recordings, 1, &options, &model, &report, &failure));
    expect_line(&failure, "period");
    recording_free(&recordings[0]);
    recording_free(&recordings[1]);
}

int main(void) {
    rng = random_start("test_ellipse_model", 20261003);
    UNITY_BEGIN();
    RUN_TEST(test_the_block_draws_every_ellipse_of_the_table);
    RUN_TEST(test_one_ellipse_is_exact);
    RUN_TEST(test_any_drive_stays_within_the_gain);
    RUN_TEST(test_between_frequencies_nothing_overshoots);
    RUN_TEST(test_the_inverse_phaser_undoes_the_block);
    RUN_TEST(test_no_image_for_a_frequency_that_is_not_known);
    RUN_TEST(test_tables_that_make_no_sense_are_refused);
    RUN_TEST(test_the_family_finds_the_table_again);
    RUN_TEST(test_halves_have_the_sharp_tips);
    RUN_TEST(test_the_family_says_what_it_needs);
    return UNITY_END();
}
