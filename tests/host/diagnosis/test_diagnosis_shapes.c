/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Smooth hystereses of few numbers, and the numbers that a diagnosis changes. */
#include "diagnosis/evidence/joint_fit.h"
#include "diagnosis/nuisance/hysteresis_numbers.h"
#include "diagnosis/nuisance/smooth_bank.h"
#include "diagnosis/nuisance/smooth_plane.h"
#include "numerics/splines.h"
#include "support.h"
#include "unity.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double rate_hz = 1000.0;
static const double range_v[2] = {-20.0, 120.0};
enum { LENGTH = 6000 };
static random_t rng;
static recording_t recording;
static failure_t failure;

/* The whole range, then smaller and smaller loops, then a random walk. */
void setUp(void) {
    const double corner[] = {-20.0, 120.0, -20.0, 90.0, 0.0, 70.0, 20.0, 60.0, 30.0, 52.0, 36.0, 45.0};
    recording_create(&recording, "loops.csv", rate_hz, LENGTH);
    double *drive = recording.column[COLUMN_DRIVE];
    fill_lines(drive, LENGTH, corner, 12, 200);
    for (size_t k = 2400; k < LENGTH; k++) {
        const double next = drive[k - 1] + 3.0 * random_normal(&rng);
        drive[k] = fmax(range_v[0], fmin(range_v[1], next));
    }
}

void tearDown(void) {
    recording_free(&recording);
}

static void test_splines_are_one_together(void) {
    for (size_t intervals = 1; intervals <= 8; intervals++) {
        for (size_t k = 0; k <= 16 * intervals; k++) {
            const double x = (double)k / 16.0;
            double sum = 0.0;
            for (size_t i = 0; i < intervals + 2; i++) {
                const double here = spline(i, x);
                TEST_ASSERT_TRUE(here >= 0.0);
                TEST_ASSERT_TRUE(here == 0.0 || (x > (double)i - 2.0 && x < (double)i + 1.0));
                sum += here;
            }
            TEST_ASSERT_DOUBLE_WITHIN(1e-14, 1.0, sum);
        }
    }
}

/* E over middle m and half width r: r (1 + 0.5 r - 0.3 m^2 + skew m), which lies in the space of the splines. */
static double everett(double high, double low, double skew) {
    const double m = 0.5 * (high + low), r = 0.5 * (high - low);
    return r * (1.0 + 0.5 * r - 0.3 * m * m + skew * m);
}

static void make_plane(model_t *model, size_t intervals, double skew) {
    double *level_v = allocate(intervals + 1, sizeof(double));
    double *table = allocate(preisach_elements(intervals + 1), sizeof(double));
    for (size_t i = 0; i <= intervals; i++) {
        level_v[i] = range_v[0] + (range_v[1] - range_v[0]) * (double)i / (double)intervals;
        for (size_t j = 0; j < i; j++) {
            table[preisach_element(i, j)] =
                everett(2.0 * (double)i / (double)intervals - 1.0, 2.0 * (double)j / (double)intervals - 1.0, skew);
        }
    }
    model_create(model, rate_hz);
    model_block_t *block = model_append(model, &block_preisach);
    model_set_array(block, "levels_v", intervals + 1, level_v, NULL);
    model_set_array(block, "everett_um", preisach_elements(intervals + 1), table, NULL);
    free(level_v);
    free(table);
}

static double largest_difference(const model_t *one, const model_t *other) {
    recording_t copy;
    double largest = 0.0;
    recording_create(&copy, "other.csv", rate_hz, LENGTH);
    memcpy(copy.column[COLUMN_DRIVE], recording.column[COLUMN_DRIVE], LENGTH * sizeof(double));
    simulate_into(&recording, one, 1);
    simulate_into(&copy, other, 1);
    for (size_t k = 0; k < LENGTH; k++) {
        largest = fmax(largest, fabs(recording.column[COLUMN_DISPLACEMENT][k] - copy.column[COLUMN_DISPLACEMENT][k]));
    }
    recording_free(&copy);
    return largest;
}

/* A plane that is one of theirs comes back, but for its own coarseness: E's curvature of 0.6 at most over intervals of
 * 2/60, bilinear, leaves 0.6 / 8 / 900 < 1e-4 a branch, with up to a dozen nested ones. The other mirrored functions
 * are missing in a symmetric plane: a skew of 0.2 is then off by a percent of the stroke or more. */
static void test_a_smooth_plane_comes_back(void) {
    for (int skewed = 0; skewed < 2; skewed++) {
        for (int symmetric = 0; symmetric < 2; symmetric++) {
            model_t truth, smooth;
            make_plane(&truth, 60, skewed ? 0.2 : 0.0);
            model_copy(&smooth, &truth);
            TEST_ASSERT_TRUE_MESSAGE(smooth_plane_from(&smooth.block[0], range_v, symmetric, &failure), failure.text);
            const double error = largest_difference(&truth, &smooth);
            if (skewed && symmetric) {
                TEST_ASSERT_TRUE(error > 0.02);
            } else {
                TEST_ASSERT_TRUE(error < 1.2e-3);
            }
            model_free(&truth);
            model_free(&smooth);
        }
    }
}

/* Drives beyond the levels: the plane goes on straight, and so do the smooth one's levels. */
static void test_a_plane_grows_to_the_range_it_is_asked_for(void) {
    const double wide_v[2] = {-30.0, 150.0};
    model_t plane;
    make_plane(&plane, 30, 0.0);
    TEST_ASSERT_TRUE(smooth_plane_from(&plane.block[0], wide_v, false, &failure));
    const parameter_t *levels = model_parameter(&plane.block[0], "levels_v");
    TEST_ASSERT_EQUAL_DOUBLE(wide_v[0], levels->value[0]);
    TEST_ASSERT_EQUAL_DOUBLE(wide_v[1], levels->value[levels->count - 1]);
    TEST_ASSERT_TRUE_MESSAGE(model_check(&plane, "plane", &failure), failure.text);
    model_free(&plane);
}

static bool is_symmetric(const model_t *model) {
    return smooth_plane_is_symmetric(model_parameter(&model->block[0], "levels_v")->count,
                                     model_parameter(&model->block[0], "everett_um")->value);
}

static void change_at_random(const hysteresis_numbers_t *numbers) {
    for (size_t i = 0; i < numbers->count; i++) {
        hysteresis_number_add(&numbers->number[i], 0.1 * random_normal(&rng));
    }
}

/* Whatever its numbers are, a symmetric plane stays one; and only it has the smaller number of them. */
static void test_symmetric_planes_stay_symmetric(void) {
    model_t plane, skewed;
    hysteresis_numbers_t numbers;
    make_plane(&plane, 60, 0.0);
    make_plane(&skewed, 60, 0.01);
    TEST_ASSERT_TRUE(smooth_plane_from(&plane.block[0], range_v, true, &failure));
    TEST_ASSERT_TRUE(is_symmetric(&plane));
    TEST_ASSERT_FALSE(is_symmetric(&skewed));
    TEST_ASSERT_TRUE(hysteresis_numbers_count(&plane) < hysteresis_numbers_count(&skewed));
    for (int round = 0; round < 20; round++) {
        hysteresis_numbers_open(&plane, &numbers);
        TEST_ASSERT_EQUAL(hysteresis_numbers_count(&plane), numbers.count);
        change_at_random(&numbers);
        hysteresis_numbers_close(&numbers);
        TEST_ASSERT_TRUE(is_symmetric(&plane));
    }
    model_free(&plane);
    model_free(&skewed);
}

/* A staircase of 24 thresholds 3 V apart, each a kink of 1/24 of the loop, becomes a curve between: a few thousandths
 * of the stroke. Memory of before the recording is carried over. */
static void test_a_smooth_bank_is_near_the_bank(void) {
    enum { OPERATORS = 24 };
    double weights[OPERATORS + 1] = {0.06}, thresholds_v[OPERATORS], memory_v[OPERATORS];
    model_t bank, smooth;
    for (size_t i = 0; i < OPERATORS; i++) {
        thresholds_v[i] = 3.0 * (double)(i + 1) - 1.5;
        weights[i + 1] = 0.002 * exp(-thresholds_v[i] / 40.0);
        memory_v[i] = -20.0 + thresholds_v[i]; /* it has come down from above */
    }
    make_bank_model(&bank, rate_hz, 1.0, OPERATORS, weights, thresholds_v);
    model_set_array(&bank.block[0], "initial_memory_v", OPERATORS, memory_v, NULL);
    model_copy(&smooth, &bank);
    TEST_ASSERT_TRUE_MESSAGE(smooth_bank_from(&smooth.block[0], &failure), failure.text);
    TEST_ASSERT_TRUE_MESSAGE(model_check(&smooth, "bank", &failure), failure.text);
    TEST_ASSERT_EQUAL(1 + 1 + SMOOTH_BANK_FUNCTIONS, hysteresis_numbers_count(&smooth));
    TEST_ASSERT_TRUE(largest_difference(&bank, &smooth) < 0.004 * 140.0 * 0.08);
    model_free(&bank);
    model_free(&smooth);
}

/* A term that a shape has not is none of its numbers. */
static void test_absent_terms_are_no_numbers(void) {
    model_t model;
    model_create(&model, rate_hz);
    model_block_t *bouc_wen = model_append(&model, &block_bouc_wen);
    model_set(bouc_wen, "direct_um", 5.0);
    model_set(bouc_wen, "hysteretic_um", -1.0);
    model_set(bouc_wen, "beta", 1.3);
    model_set(bouc_wen, "gamma", 0.0); /* 0, and a number of every such shape */
    TEST_ASSERT_EQUAL(6, hysteresis_numbers_count(&model));
    model_set(bouc_wen, "bilinear_gain", 1e-9);
    TEST_ASSERT_EQUAL(7, hysteresis_numbers_count(&model));
    model_free(&model);
}

/* To the last bit, or an exponent that rests on its bound falls below it. */
static void test_numbers_are_restored_to_the_last_bit(void) {
    model_t model[3];
    const double weights[] = {0.1, 0.03, 0.0}, thresholds_v[] = {3.0, 9.0};
    make_bank_model(&model[0], rate_hz, 1.0, 2, weights, thresholds_v);
    make_plane(&model[1], 20, 0.1);
    model_create(&model[2], rate_hz);
    model_block_t *bouc_wen = model_append(&model[2], &block_bouc_wen);
    model_set(bouc_wen, "direct_um", 5.0);
    model_set(bouc_wen, "hysteretic_um", 1.0 / 3.0);
    model_set(bouc_wen, "beta", 1.3);
    for (size_t i = 0; i < 3; i++) {
        model_t before;
        hysteresis_numbers_t numbers;
        model_copy(&before, &model[i]);
        hysteresis_numbers_open(&model[i], &numbers);
        for (int round = 0; round < 100; round++) {
            hysteresis_numbers_keep(&numbers);
            change_at_random(&numbers);
            hysteresis_numbers_restore(&numbers);
        }
        for (size_t p = 0; p < before.block[0].block->parameters; p++) {
            const parameter_t *was = &before.block[0].parameter[p], *is = &model[i].block[0].parameter[p];
            TEST_ASSERT_EQUAL(was->count, is->count);
            TEST_ASSERT_TRUE(was->count == 0 || memcmp(was->value, is->value, was->count * sizeof(double)) == 0);
        }
        hysteresis_numbers_close(&numbers);
        model_free(&before);
        model_free(&model[i]);
    }
}

/* Standard errors are what fits to many noises scatter by: 40 of them know it to a ninth, three of which are allowed.
 */
static void test_errors_are_the_scatter(void) {
    enum { NOISES = 40 };
    const double noise_um = 0.02;
    const noise_t noise = {.sigma_um = noise_um, .rms_um = noise_um};
    model_t plane, truth;
    double sum = 0.0, squares = 0.0, sigma = 0.0;
    make_plane(&plane, 60, 0.1);
    insert_block(&truth, &plane, &block_sensor_bandwidth, (const double[]){60.0});
    for (int round = 0; round < NOISES; round++) {
        model_t fitted;
        samples_t samples;
        joint_power_t power;
        simulate_into(&recording, &truth, 1);
        for (size_t k = 0; k < LENGTH; k++) {
            recording.column[COLUMN_DISPLACEMENT][k] += noise_um * random_normal(&rng);
        }
        model_copy(&fitted, &truth);
        TEST_ASSERT_TRUE_MESSAGE(samples_open(&samples, &fitted, &recording, 1, &failure), failure.text);
        TEST_ASSERT_TRUE(joint_fit(&samples, &noise, &fitted, 2, 8, &power, &failure));
        TEST_ASSERT_TRUE(joint_errors(&samples, &noise, &fitted, 2, &failure));
        const parameter_t *cutoff = model_parameter(&fitted.block[1], "cutoff_hz");
        sum += cutoff->value[0] / NOISES;
        squares += cutoff->value[0] * cutoff->value[0] / NOISES;
        sigma += cutoff->sigma[0] / NOISES;
        samples_close(&samples);
        model_free(&fitted);
    }
    const double scatter = sqrt((squares - sum * sum) * NOISES / (NOISES - 1.0));
    TEST_ASSERT_DOUBLE_WITHIN(0.33, 1.0, scatter / sigma);
    TEST_ASSERT_DOUBLE_WITHIN(5.0 * sigma / sqrt(NOISES), 60.0, sum);
    model_free(&plane);
    model_free(&truth);
}

int main(void) {
    rng = random_start("diagnosis_shapes", 20261121);
    UNITY_BEGIN();
    RUN_TEST(test_splines_are_one_together);
    RUN_TEST(test_a_smooth_plane_comes_back);
    RUN_TEST(test_a_plane_grows_to_the_range_it_is_asked_for);
    RUN_TEST(test_symmetric_planes_stay_symmetric);
    RUN_TEST(test_a_smooth_bank_is_near_the_bank);
    RUN_TEST(test_absent_terms_are_no_numbers);
    RUN_TEST(test_numbers_are_restored_to_the_last_bit);
    RUN_TEST(test_errors_are_the_scatter);
    return UNITY_END();
}
