/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Ellipses: the fit against loops from an independent generator, the block against the same, the inverse against the
 * block. */
#include "catalogue.h"
#include "compile.h"
#include "ellipse_fit.h"
#include "ellipses_003.h"
#include "fit.h"
#include "hyst/compensator.h"
#include "phaser.h"
#include "sine_fit.h"
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

enum { POINTS = 20000 };
static double x[POINTS], y[POINTS];

/* The rebuilt loop as measured: noise, then 16 bits over 150 V and 90 um; in the plane of the table. */
static void rebuild(const ellipse_003_t *row, size_t count, double noise_um) {
    for (size_t k = 0; k < count; k++) {
        double drive_v, displacement_um;
        /* 10 kHz; where that gives few phases (300 Hz: 100), noise spreads them over the codes */
        ellipse_003_point(row, 2.0 * M_PI * row->frequency_hz * (double)k / 10000.0, &drive_v, &displacement_um);
        x[k] = floor(drive_v / 150.0 * 65536.0 + 0.5) / 65536.0;
        y[k] = floor((displacement_um + noise_um * random_normal(&rng)) / 90.0 * 65536.0 + 0.5) / 65536.0;
    }
}

/* The printed digits, all nine rows, from two seconds with 5 nm of noise. (The noise bends thin ellipses: 10 nm already
 * cost 4e-5 of the 5e-5 that half a digit is.) */
static void test_recovers_the_published_table(void) {
    double worst = 0.0;
    for (size_t i = 0; i < ELLIPSES_003; i++) {
        const ellipse_003_t *row = &ellipses_003[i];
        ellipse_t found, sigma;
        failure_t failure;
        rebuild(row, POINTS, 0.005);
        TEST_ASSERT_TRUE_MESSAGE(ellipse_fit(x, y, POINTS, &found, &sigma, &failure), failure.text);
        const double deviation[] = {found.x_center - row->x_center, found.y_center - row->y_center,
                                    found.major - row->major, found.minor - row->minor, found.angle - row->angle};
        for (size_t j = 0; j < 5; j++) {
            worst = fmax(worst, fabs(deviation[j]));
            TEST_ASSERT_TRUE_MESSAGE(fabs(deviation[j]) < 5e-5, "a printed digit differs");
        }
    }
    printf("table 1 of 003: worst deviation %.2g, half a printed digit is 5e-5\n", worst);
}

/* A Monte Carlo of 300 fits: the scatter is what the standard errors say. */
static void test_standard_errors_are_the_scatter(void) {
    enum { RUNS = 300, COUNT = 400 };
    const ellipse_003_t *row = &ellipses_003[7];
    double sum[5] = {0}, squares[5] = {0}, sigmas[5] = {0};
    for (int run = 0; run < RUNS; run++) {
        ellipse_t found, sigma;
        failure_t failure;
        rebuild(row, COUNT, 0.05);
        TEST_ASSERT_TRUE(ellipse_fit(x, y, COUNT, &found, &sigma, &failure));
        const double value[] = {found.x_center - row->x_center, found.y_center - row->y_center,
                                found.major - row->major, found.minor - row->minor, found.angle - row->angle};
        const double error[] = {sigma.x_center, sigma.y_center, sigma.major, sigma.minor, sigma.angle};
        for (size_t j = 0; j < 5; j++) {
            sum[j] += value[j] / RUNS;
            squares[j] += value[j] * value[j] / RUNS;
            sigmas[j] += error[j] / RUNS;
        }
    }
    for (size_t j = 0; j < 5; j++) {
        const double scatter = sqrt(squares[j] - sum[j] * sum[j]);
        /* The scatter of 300 runs is known to 1 / sqrt(600) = 4 %; five of these. */
        TEST_ASSERT_DOUBLE_WITHIN(0.2 * scatter, scatter, sigmas[j]);
        /* Noise makes an algebraic fit a little small: second order in the noise, below a scatter here. */
        TEST_ASSERT_TRUE(fabs(sum[j]) < scatter);
    }
}

static void test_the_fit_moves_with_the_plane(void) {
    for (int run = 0; run < 200; run++) {
        enum { COUNT = 60 };
        const double p = exp(6.0 * random_unit(&rng)), q = exp(-6.0 * random_unit(&rng)),
                     shift = 100.0 * random_unit(&rng);
        ellipse_t here, there;
        failure_t failure;
        const ellipse_sines_t sines = {1.0, 1.0, 0.05 + 3.0 * random_unit(&rng)};
        for (int k = 0; k < COUNT; k++) { /* no ellipse exactly, and uneven */
            const double theta = 6.0 * random_unit(&rng);
            x[k] = sin(theta) + 0.01 * random_normal(&rng);
            y[k] = sin(theta - sines.lag) + 0.01 * random_normal(&rng);
            x[COUNT + k] = p * x[k] + shift;
            y[COUNT + k] = q * y[k] - shift;
        }
        if (!ellipse_fit(x, y, COUNT, &here, NULL, &failure)) {
            continue;
        }
        TEST_ASSERT_TRUE(ellipse_fit(x + COUNT, y + COUNT, COUNT, &there, NULL, &failure));
        const ellipse_sines_t a = ellipse_sines(&here), b = ellipse_sines(&there);
        TEST_ASSERT_DOUBLE_WITHIN(1e-6, a.x_radius, b.x_radius / p);
        TEST_ASSERT_DOUBLE_WITHIN(1e-6, a.y_radius, b.y_radius / q);
        TEST_ASSERT_DOUBLE_WITHIN(1e-6, a.lag, b.lag);
        TEST_ASSERT_DOUBLE_WITHIN(1e-5, here.x_center, (there.x_center - shift) / p);
    }
}

static void test_sines_and_ellipses_are_two_views_of_one_thing(void) {
    for (int run = 0; run < 10000; run++) {
        const ellipse_sines_t sines = {exp(4.0 * random_unit(&rng) - 2.0), exp(4.0 * random_unit(&rng) - 2.0),
                                       0.01 + 3.12 * random_unit(&rng)};
        const ellipse_t ellipse = ellipse_of_sines(3.0, -4.0, &sines);
        const ellipse_sines_t back = ellipse_sines(&ellipse);
        TEST_ASSERT_TRUE(ellipse.major >= ellipse.minor && ellipse.minor > 0.0);
        TEST_ASSERT_DOUBLE_WITHIN(1e-9 * sines.x_radius, sines.x_radius, back.x_radius);
        TEST_ASSERT_DOUBLE_WITHIN(1e-9 * sines.y_radius, sines.y_radius, back.y_radius);
        TEST_ASSERT_DOUBLE_WITHIN(1e-6, sines.lag, back.lag); /* cos of a small lag loses half the digits */
        /* and the two arcs meet the sines */
        const double theta = 1.3, at = 3.0 + sines.x_radius * sin(theta); /* on the way up */
        TEST_ASSERT_DOUBLE_WITHIN(1e-5 * sines.y_radius, -4.0 + sines.y_radius * sin(theta - sines.lag),
                                  ellipse_arc(&ellipse, at, -1.0));
    }
}

static void test_refuses_what_is_no_ellipse(void) {
    ellipse_t found;
    failure_t failure;
    for (int k = 0; k < 100; k++) {
        x[k] = k;
        y[k] = 3.0 * k - 7.0;
    }
    TEST_ASSERT_FALSE(ellipse_fit(x, y, 100, &found, NULL, &failure));
    expect_line(&failure, "straight line");
    TEST_ASSERT_FALSE(ellipse_fit(x, y, 5, &found, NULL, &failure));
    expect_line(&failure, "too few");
    for (int k = 0; k < 100; k++) { /* a point, many times */
        x[k] = y[k] = 1.0;
    }
    TEST_ASSERT_FALSE(ellipse_fit(x, y, 100, &found, NULL, &failure));
    x[3] = (double)NAN;
    TEST_ASSERT_FALSE(ellipse_fit(x, y, 100, &found, NULL, &failure));
}

static void test_a_sine_is_found_with_its_frequency(void) {
    const double frequency = 17.3, phase = -2.0;
    sine_t sine;
    failure_t failure;
    for (int k = 0; k < 2000; k++) {
        y[k] = 75.0 + 15.0 * sin(2.0 * M_PI * frequency * k / 10000.0 + phase) + 0.01 * random_normal(&rng);
    }
    TEST_ASSERT_TRUE_MESSAGE(sine_fit(y, 2000, 10000.0, &sine, &failure), failure.text);
    /* Five of the standard errors 0.01 sqrt(2 / 2000) (of the amplitude) and sqrt(6) / (pi 0.2 s) of its relative size.
     */
    TEST_ASSERT_DOUBLE_WITHIN(1.6e-3, 15.0, sine.amplitude);
    TEST_ASSERT_DOUBLE_WITHIN(1.6e-3, 75.0, sine.offset);
    TEST_ASSERT_DOUBLE_WITHIN(5e-4, frequency, sine.frequency_hz);
    TEST_ASSERT_DOUBLE_WITHIN(5e-4, phase, sine.phase);
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, 0.01, sine.rms);
    for (int k = 0; k < 2000; k++) {
        y[k] = k;
    }
    TEST_ASSERT_FALSE(sine_fit(y, 2000, 10000.0, &sine, &failure));
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
    rng = random_start("test_ellipse", 20261003);
    UNITY_BEGIN();
    RUN_TEST(test_recovers_the_published_table);
    RUN_TEST(test_standard_errors_are_the_scatter);
    RUN_TEST(test_the_fit_moves_with_the_plane);
    RUN_TEST(test_sines_and_ellipses_are_two_views_of_one_thing);
    RUN_TEST(test_refuses_what_is_no_ellipse);
    RUN_TEST(test_a_sine_is_found_with_its_frequency);
    RUN_TEST(test_the_block_draws_every_ellipse_of_the_table);
    RUN_TEST(test_one_ellipse_is_exact);
    RUN_TEST(test_between_frequencies_nothing_overshoots);
    RUN_TEST(test_the_inverse_phaser_undoes_the_block);
    RUN_TEST(test_no_image_for_a_frequency_that_is_not_known);
    RUN_TEST(test_tables_that_make_no_sense_are_refused);
    RUN_TEST(test_the_family_finds_the_table_again);
    RUN_TEST(test_halves_have_the_sharp_tips);
    RUN_TEST(test_the_family_says_what_it_needs);
    return UNITY_END();
}
