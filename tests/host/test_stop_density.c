/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The density form against the stop operator's own definition, against areas in closed form, and what the numbers that
 * are printed for it do. */
#include "chain/catalogue.h"
#include "compile/compile.h"
#include "identify/fit.h"
#include "support.h"
#include "unity.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

enum { MOST_LEVELS = 60 };

typedef struct {
    double offset, gain, alpha, beta, delta, a, b;
    size_t levels;
    double level[MOST_LEVELS];
} numbers_t;

void setUp(void) {
}
void tearDown(void) {
}

static void fill_levels(numbers_t *numbers, size_t levels, double top) {
    numbers->levels = levels;
    for (size_t j = 0; j < levels; j++) {
        numbers->level[j] = top * (double)(j + 1) / (double)levels;
    }
}

static void make_model(const numbers_t *numbers, model_t *model) {
    model_create(model, 1000.0);
    model_block_t *block = model_append(model, &block_stop_density);
    model_set(block, "offset_um", numbers->offset);
    model_set(block, "gain_um_per_v", numbers->gain);
    model_set(block, "alpha_um_per_v2", numbers->alpha);
    model_set(block, "beta_per_v2", numbers->beta);
    model_set(block, "delta_v", numbers->delta);
    model_set(block, "a", numbers->a);
    model_set(block, "b_v", numbers->b);
    model_set_array(block, "levels_v", numbers->levels, numbers->level, NULL);
}

static chain_t *open_chain(const numbers_t *numbers) {
    model_t model;
    failure_t failure = {{0}};
    make_model(numbers, &model);
    chain_t *chain = chain_open(&model, 1000.0, 1, &failure);
    TEST_ASSERT_NOT_NULL_MESSAGE(chain, failure.text);
    model_free(&model);
    return chain;
}

/* Every stop by its definition, equations (2.29) to (2.31) of [002]. */
static void test_is_the_sum_of_stops_that_it_says(void) {
    random_t random = random_start("stop density", 1);
    for (int run = 0; run < 50; run++) {
        numbers_t numbers = {.offset = random_normal(&random),
                             .gain = random_normal(&random),
                             .alpha = random_normal(&random),
                             .beta = 0.01 * random_unit(&random),
                             .delta = 30.0 * random_normal(&random),
                             .a = 0.1 + 3.0 * random_unit(&random),
                             .b = 5.0 * random_unit(&random)};
        fill_levels(&numbers, 1 + (size_t)random_between(&random, 0, MOST_LEVELS - 1), 40.0);
        chain_t *chain = open_chain(&numbers);
        double stop[MOST_LEVELS] = {0}, before = 0.0, scale = 0.0;
        chain_settle(chain, 0.0);
        for (int k = 0; k < 300; k++) {
            const double v = 60.0 * random_normal(&random);
            double expected = numbers.offset + numbers.gain * v, last = numbers.b;
            for (size_t j = 0; j < numbers.levels; j++) {
                const double r = numbers.a * numbers.level[j] + numbers.b, distance = r - numbers.delta;
                stop[j] = fmin(r, fmax(-r, v - before + stop[j]));
                expected -= numbers.alpha * exp(-numbers.beta * distance * distance) * stop[j] * (r - last);
                last = r;
            }
            before = v;
            scale = fmax(scale, fabs(expected));
            /* Differences of drives add up to 300 roundings of numbers below 1000 V, times weights that scale shows. */
            TEST_ASSERT_DOUBLE_WITHIN(1e-10 * (1.0 + scale), expected, chain_step(chain, v));
        }
        chain_close(chain);
    }
}

/* Integral of y dv around a settled loop between -amplitude and amplitude: positive is clockwise. A play of threshold r
 * encloses 4 r (amplitude - r), counterclockwise. */
static double loop_area(const numbers_t *numbers, double amplitude) {
    enum { PER_LINE = 1000 };
    double area = 0.0, v = 0.0, y, last_v, last_y;
    chain_t *chain = open_chain(numbers);
    chain_settle(chain, 0.0);
    for (int k = 0; k <= 2 * PER_LINE; k++) {
        chain_step(chain, amplitude * (k <= PER_LINE ? 1.0 : -1.0) * (double)(k % (PER_LINE + 1)) / PER_LINE);
    }
    y = chain_step(chain, -amplitude);
    v = -amplitude;
    for (int k = 1; k <= 2 * PER_LINE; k++) {
        const double part = (double)(k <= PER_LINE ? k : 2 * PER_LINE - k) / PER_LINE;
        last_v = v;
        last_y = y;
        v = amplitude * (2.0 * part - 1.0);
        y = chain_step(chain, v);
        area += 0.5 * (y + last_y) * (v - last_v);
    }
    chain_close(chain);
    return area;
}

static void test_turns_counterclockwise_as_a_piezo_does(void) {
    numbers_t numbers = {.offset = 1.0, .gain = 0.5, .alpha = 0.002, .beta = 0.001, .delta = 10.0, .a = 0.5, .b = 2.0};
    double expected = 0.0, last = numbers.b;
    fill_levels(&numbers, 20, 50.0);
    for (size_t j = 0; j < numbers.levels; j++) {
        const double r = numbers.a * numbers.level[j] + numbers.b, distance = r - numbers.delta;
        expected -= 4.0 * r * (40.0 - r) * numbers.alpha * exp(-numbers.beta * distance * distance) * (r - last);
        last = r;
    }
    /* Twenty corners inside intervals of 0.08 V, each cut by less than 0.08^2 times its weight of at most 0.003. */
    TEST_ASSERT_DOUBLE_WITHIN(2.0 * 20.0 * 0.08 * 0.08 * 0.003, expected, loop_area(&numbers, 40.0));
    TEST_ASSERT_TRUE(expected < 0.0);
    numbers.alpha = -numbers.alpha; /* the sign in which the thesis prints it */
    TEST_ASSERT_DOUBLE_WITHIN(2.0 * 20.0 * 0.08 * 0.08 * 0.003, -expected, loop_area(&numbers, 40.0));
}

/*
 * Table 4.1 of [002], as printed: positive stops alone, thresholds a v + b. With a > 1 the threshold of a level is
 * above the level, so a stop never slips before the drive has gone beyond its own level: the stops that belong to the
 * drive's own value, r(t) = a v(t) + b, have no hysteresis. On a grid of levels those below about half the drive do
 * slip, and turn clockwise.
 */
static void test_what_the_printed_numbers_do(void) {
    static const struct {
        double top, alpha, beta, a, b, delta;
    } rows[] = {{40, 5.79, 0.000081, 4.38, 0.133, 4},
                {70, 5.65, 0.000001, 4.60, 0.163, 7},
                {70, 5.16, 0.000009, 2.87, 0.411, 9.1}};
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        numbers_t numbers = {.alpha = -rows[i].alpha,
                             .beta = rows[i].beta,
                             .delta = rows[i].delta,
                             .a = rows[i].a,
                             .b = rows[i].b,
                             .levels = 1};
        for (int level = 1; level <= 10; level++) {
            numbers.level[0] = rows[i].top * level / 10.0;
            chain_t *chain = open_chain(&numbers);
            chain_settle(chain, 0.0);
            const double slope = chain_step(chain, numbers.level[0]) / numbers.level[0];
            for (int k = 0; k < 1000; k++) {
                const double v = 0.5 * numbers.level[0] * (1.0 - cos(0.02 * k));
                TEST_ASSERT_DOUBLE_WITHIN(1e-12 * slope * rows[i].top, slope * v, chain_step(chain, v));
            }
            chain_close(chain);
        }
        fill_levels(&numbers, MOST_LEVELS, rows[i].top);
        TEST_ASSERT_TRUE(loop_area(&numbers, 0.5 * rows[i].top) > 0.0);
    }
}

static void test_compiles_to_its_play_bank(void) {
    numbers_t numbers = {.offset = 1.0, .gain = 0.3, .alpha = 0.004, .beta = 0.004, .delta = -5.0, .a = 0.9, .b = 1.5};
    const compile_options_t options = {.drive_range_v = {0.0, 100.0}, .position_range_um = {-2.0, 40.0}};
    hyst_parameters_t image, expected_image;
    double weights[MOST_LEVELS + 1] = {0}, thresholds[MOST_LEVELS], last = numbers.b;
    failure_t failure = {{0}};
    model_t model, bank;
    fill_levels(&numbers, 40, 45.0);
    make_model(&numbers, &model);
    weights[0] = numbers.gain;
    for (size_t j = 0; j < numbers.levels; j++) {
        const double r = numbers.a * numbers.level[j] + numbers.b, distance = r - numbers.delta;
        thresholds[j] = r;
        weights[j + 1] = numbers.alpha * exp(-numbers.beta * distance * distance) * (r - last);
        weights[0] -= weights[j + 1];
        last = r;
    }
    make_bank_model(&bank, 1000.0, numbers.offset, numbers.levels, weights, thresholds);
    TEST_ASSERT_TRUE_MESSAGE(compile_model(&model, &options, &image, NULL, &failure), failure.text);
    TEST_ASSERT_TRUE_MESSAGE(compile_model(&bank, &options, &expected_image, NULL, &failure), failure.text);
    TEST_ASSERT_EQUAL_UINT32(expected_image.pi_operators, image.pi_operators);
    for (size_t j = 0; j <= image.pi_operators; j++) { /* one unit: the weights were summed up in another order */
        TEST_ASSERT_INT_WITHIN(1, expected_image.pi_weight[j], image.pi_weight[j]);
    }
    TEST_ASSERT_EQUAL_MEMORY(expected_image.pi_threshold, image.pi_threshold,
                             image.pi_operators * sizeof image.pi_threshold[0]);
    model_free(&bank);
    model_free(&model);
}

/* With the weights above the gain, the position falls when the drive rises after a turning point. */
static void test_is_refused_where_it_has_no_inverse(void) {
    numbers_t numbers = {.gain = 0.1, .alpha = 0.01, .a = 1.0};
    const compile_options_t options = {.drive_range_v = {0.0, 100.0}, .position_range_um = {-5.0, 15.0}};
    hyst_parameters_t image;
    failure_t failure = {{0}};
    model_t model;
    fill_levels(&numbers, 10, 20.0);
    make_model(&numbers, &model);
    TEST_ASSERT_FALSE(compile_model(&model, &options, &image, NULL, &failure));
    expect_line(&failure, "pi_weight, element 0: not invertible");
    model_free(&model);
}

static void test_levels_must_rise(void) {
    numbers_t numbers = {.gain = 0.3, .alpha = 0.001, .a = 1.0};
    failure_t failure = {{0}};
    model_t model;
    fill_levels(&numbers, 10, 20.0);
    numbers.level[4] = numbers.level[3];
    make_model(&numbers, &model);
    TEST_ASSERT_FALSE(model_check(&model, "model", &failure));
    expect_line(&failure, "levels_v[4] does not rise");
    model_free(&model);
}

/* Sweeps of many sizes, with noise. */
static void make_recording(const numbers_t *numbers, double noise_um, random_t *random, recording_t *recording) {
    static const double corners[] = {0, 80, 0, 70, 10, 60, 20, 50, 30, 40, 80};
    enum { SAMPLES = 3300, PER_LINE = 100 };
    model_t model;
    make_model(numbers, &model);
    recording_create(recording, "synthetic", 1000.0, SAMPLES);
    fill_lines(recording->column[COLUMN_DRIVE], SAMPLES, corners, sizeof corners / sizeof corners[0], PER_LINE);
    simulate_into(recording, &model, 1);
    for (size_t k = 0; k < SAMPLES; k++) {
        recording->column[COLUMN_DISPLACEMENT][k] += noise_um * random_normal(random);
    }
    model_free(&model);
}

static void fit(const recording_t *recordings, size_t count, model_t *model, fit_report_t *report) {
    const fit_options_t options = {0};
    failure_t failure = {{0}};
    TEST_ASSERT_TRUE_MESSAGE(fit_recordings(&family_stop_density, recordings, count, &options, model, report, &failure),
                             failure.text);
}

static double value_of(const model_t *model, const char *name) {
    return model_parameter(&model->block[0], name)->value[0];
}

static bool has_note(const fit_report_t *report, const char *text) {
    bool found = false;
    for (size_t i = 0; i < report->notes.count; i++) {
        found = found || strstr(report->notes.line[i], text) != NULL;
    }
    return found;
}

/* Half a branch, as a function of how far the drive has gone from the turning point: what a recording determines. */
static double half_branch(const model_t *model, double x) {
    const parameter_t *levels = model_parameter(&model->block[0], "levels_v");
    const double a = value_of(model, "a"), b = value_of(model, "b_v");
    double sum = value_of(model, "gain_um_per_v") * x, last = b;
    for (size_t j = 0; j < levels->count; j++) {
        const double r = a * levels->value[j] + b, distance = r - value_of(model, "delta_v");
        sum -= value_of(model, "alpha_um_per_v2") * exp(-value_of(model, "beta_per_v2") * distance * distance) *
               fmin(x, r) * (r - last);
        last = r;
    }
    return sum;
}

static void test_a_fit_finds_its_own_numbers(void) {
    random_t random = random_start("stop density fit", 2);
    for (int run = 0; run < 5; run++) {
        numbers_t truth = {.offset = 1.0,
                           .gain = 0.35,
                           .alpha = 0.004 + 0.003 * random_unit(&random),
                           .beta = 0.003 + 0.005 * random_unit(&random),
                           .delta = 5.0 + 15.0 * random_unit(&random),
                           .a = 0.8,
                           .b = 1.0 + 3.0 * random_unit(&random)};
        recording_t recordings[2];
        fit_report_t report;
        model_t model, true_model;
        fill_levels(&truth, 60, 39.0);
        for (size_t i = 0; i < 2; i++) {
            make_recording(&truth, 0.001, &random, &recordings[i]);
        }
        make_model(&truth, &true_model);
        fit(recordings, 1 + (size_t)(run % 2), &model, &report);
        printf("alpha %.5f (%.5f) beta %.5f (%.5f) delta %.2f (%.2f) b %.2f (%.2f), held out %.4f %%\n",
               value_of(&model, "alpha_um_per_v2"), truth.alpha, value_of(&model, "beta_per_v2"), truth.beta,
               value_of(&model, "delta_v"), truth.delta, value_of(&model, "b_v"), truth.b,
               report.held_out_nrmse_percent);
        /* 32 operators stand for 60: each branch is cut by at most an eighth of the square of a threshold step of 1.2 V
         * times the density, twice; and 3000 samples of noise leave less than that. */
        for (int k = 0; k <= 78; k++) {
            const double x = 0.5 * k;
            TEST_ASSERT_DOUBLE_WITHIN(0.25 * 1.2 * 1.2 * truth.alpha + 0.001, half_branch(&true_model, x),
                                      half_branch(&model, x));
        }
        TEST_ASSERT_DOUBLE_WITHIN(0.1 * truth.alpha, truth.alpha, value_of(&model, "alpha_um_per_v2"));
        TEST_ASSERT_DOUBLE_WITHIN(2.0, truth.delta, value_of(&model, "delta_v"));
        TEST_ASSERT_FALSE(has_note(&report, "are not determined"));
        fit_report_free(&report);
        model_free(&model);
        model_free(&true_model);
        recording_free(&recordings[0]);
        recording_free(&recordings[1]);
    }
}

static void test_a_fit_says_what_is_not_determined(void) {
    random_t random = random_start("stop density undetermined", 3);
    numbers_t truth = {.gain = 0.35, .alpha = 0.003, .a = 1.0};
    recording_t recording;
    fit_report_t report;
    model_t model;
    fill_levels(&truth, 32, 40.0 * 32.0 / 33.0); /* as the family spaces its own */
    make_recording(&truth, 0.001, &random, &recording);
    fit(&recording, 1, &model, &report);
    TEST_ASSERT_TRUE(has_note(&report, "delta_v are not determined"));
    TEST_ASSERT_TRUE(has_note(&report, "a is not determined from above"));
    fit_report_free(&report);
    model_free(&model);
    recording_free(&recording);

    truth.alpha = -0.003; /* clockwise: nothing that this family describes */
    make_recording(&truth, 0.001, &random, &recording);
    fit(&recording, 1, &model, &report);
    TEST_ASSERT_TRUE(has_note(&report, "no hysteresis found"));
    fit_report_free(&report);
    model_free(&model);
    recording_free(&recording);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_is_the_sum_of_stops_that_it_says);
    RUN_TEST(test_turns_counterclockwise_as_a_piezo_does);
    RUN_TEST(test_what_the_printed_numbers_do);
    RUN_TEST(test_compiles_to_its_play_bank);
    RUN_TEST(test_is_refused_where_it_has_no_inverse);
    RUN_TEST(test_levels_must_rise);
    RUN_TEST(test_a_fit_finds_its_own_numbers);
    RUN_TEST(test_a_fit_says_what_is_not_determined);
    return UNITY_END();
}
