/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The header key drive_before_v: a recording that is a part of a longer one, with the drives of the part before it in
 * its header, is simulated as it is in the longer one; and bad keys are refused. */
#include "identify/initial_memory.h"
#include "identify/play_basis.h"
#include "support.h"
#include "unity.h"
#include <gsl/gsl_math.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { LINE = 400, BEFORE = 3 * LINE, SAMPLES = 4000, OPERATORS = 12 };
static const double rate_hz = 1000.0;
static const char before[] = "0, 130, -20 , 60";
static recording_t longer, part, cut;
static failure_t failure;

/* 0, 130, -20 and 60 V, then small loops between 40 and 80 V: they erase little of it. */
void setUp(void) {
    static const double corner[] = {0.0, 130.0, -20.0, 60.0};
    recording_create(&longer, "longer.csv", rate_hz, BEFORE + SAMPLES);
    double *u = longer.column[COLUMN_DRIVE];
    fill_lines(u, BEFORE, corner, 4, LINE);
    for (size_t k = BEFORE; k < longer.samples; k++) {
        u[k] = 60.0 + 20.0 * sin(2.0 * M_PI * (double)(k - BEFORE) / 700.0);
    }
    recording_create(&part, "part.csv", rate_hz, SAMPLES);
    memcpy(part.column[COLUMN_DRIVE], u + BEFORE, SAMPLES * sizeof(double));
}

void tearDown(void) {
    recording_free(&longer);
    recording_free(&part);
}

static void make_bank(model_t *model) {
    double weights[OPERATORS + 1] = {0.05}, thresholds[OPERATORS];
    for (size_t i = 0; i < OPERATORS; i++) {
        thresholds[i] = 5.0 * (double)(i + 1);
        weights[i + 1] = 0.004;
    }
    make_bank_model(model, rate_hz, 1.0, OPERATORS, weights, thresholds);
}

/* Largest difference of the part, simulated by itself, to what it is in the longer one. */
static double difference(const model_t *model) {
    double *all = malloc(longer.samples * sizeof *all), *alone = malloc(SAMPLES * sizeof *alone), largest = 0.0;
    TEST_ASSERT_TRUE_MESSAGE(chain_simulate(model, &longer, 0, all, &failure), failure.text);
    TEST_ASSERT_TRUE_MESSAGE(chain_simulate(model, &part, 0, alone, &failure), failure.text);
    for (size_t k = 0; k < SAMPLES; k++) {
        largest = fmax(largest, fabs(all[BEFORE + k] - alone[k]));
    }
    free(all);
    free(alone);
    return largest;
}

/* Plays remember extremes, whatever the way between them: to rounding. Without the key it is 0.3 um. */
static void test_plays_begin_where_the_past_left_them(void) {
    model_t model;
    make_bank(&model);
    TEST_ASSERT_TRUE(difference(&model) > 0.1);
    recording_set_key(&part, "drive_before_v", before);
    TEST_ASSERT_TRUE(difference(&model) < 1e-12);
    model_free(&model);
}

/* The past of a part is what the longer one's past and drive make of it: to rounding of the key's 12 digits. */
static void test_a_part_keeps_its_past(void) {
    static const size_t from[] = {1, BEFORE - LINE / 2, BEFORE + 1000, BEFORE + 1234};
    model_t model;
    make_bank(&model);
    recording_set_key(&longer, "drive_before_v", "0, 140, -15, 120, 0");
    for (size_t i = 0; i < sizeof from / sizeof from[0]; i++) {
        double *all = malloc(longer.samples * sizeof *all), *alone = malloc(longer.samples * sizeof *alone);
        recording_copy(&cut, &longer, 0, longer.samples);
        TEST_ASSERT_TRUE_MESSAGE(recording_span(&cut, (double)from[i] / rate_hz, HUGE_VAL, &failure), failure.text);
        TEST_ASSERT_EQUAL_UINT64(longer.samples - from[i], cut.samples);
        TEST_ASSERT_TRUE_MESSAGE(chain_simulate(&model, &longer, 0, all, &failure), failure.text);
        TEST_ASSERT_TRUE_MESSAGE(chain_simulate(&model, &cut, 0, alone, &failure), failure.text);
        for (size_t k = 0; k < cut.samples; k++) {
            TEST_ASSERT_DOUBLE_WITHIN(1e-9, all[from[i] + k], alone[k]);
        }
        recording_free(&cut);
        free(all);
        free(alone);
    }
    model_free(&model);
}

static void expect_before(const char *was, const double *drive, size_t samples, const char *is) {
    recording_set_key(&part, "drive_before_v", was);
    recording_move_before(&part, drive, samples);
    TEST_ASSERT_EQUAL_STRING(is, recording_key(&part, "drive_before_v"));
}

static void test_what_a_hysteresis_remembers(void) {
    static const double up[] = {0.0, 1.0, 2.0, 3.0}, inner[] = {50.0, 20.0, 40.0, 30.0}, outer[] = {50.0, 20.0, 110.0};
    double spiral[40];
    for (size_t k = 0; k < 40; k++) {
        spiral[k] = (k % 2 == 0 ? 1.0 : -1.0) * (double)(40 - k);
    }
    expect_before("0, 100, 0", up, 4, "0, 100, 0, 3");
    expect_before("0, 100, 0", up, 0, "0, 100, 0");
    expect_before("0, 100, 0", inner, 4, "0, 100, 0, 50, 20, 40, 30");
    expect_before("0, 100, 0", outer, 3, "0, 110");
    expect_before("0, 100, 0", (const double[]){-5.0}, 1, "0, 100, -5");
    expect_before("7", up, 1, "7, 0");
    expect_before("0, x", up, 4, "0, x"); /* its reader refuses it */
    expect_before("0", spiral, 40, "0, 40, -39, 38, -37, 36, -35, 34, -33, 32, -31, 30, -29, 28, -27, 26");
    recording_t none;
    recording_create(&none, "none.csv", rate_hz, 4);
    recording_move_before(&none, up, 4);
    TEST_ASSERT_NULL(recording_key(&none, "drive_before_v")); /* what was before these is not known */
    recording_free(&none);
}

/* Rails in front of the hysteresis cut off what the key says, too. */
static void test_what_stands_in_front_acts_on_the_past(void) {
    static const double rails[] = {10.0, 100.0};
    model_t plain, model;
    make_bank(&plain);
    insert_block(&model, &plain, &block_amplifier_saturation, rails);
    recording_set_key(&part, "drive_before_v", before);
    TEST_ASSERT_TRUE(difference(&model) < 1e-12);
    model_free(&plain);
    model_free(&model);
}

/* Known from the first sample on where the key covers what the drive does, and not without. */
static void test_the_memory_is_determined(void) {
    model_t model;
    make_bank(&model);
    TEST_ASSERT_TRUE(chain_memory_determined(&model, &part, SAMPLES) > SAMPLES / 2);
    recording_set_key(&part, "drive_before_v", before);
    TEST_ASSERT_EQUAL_UINT64(0, chain_memory_determined(&model, &part, SAMPLES));
    recording_set_key(&part, "drive_before_v", "58, 62"); /* that erases nothing */
    TEST_ASSERT_TRUE(chain_memory_determined(&model, &part, SAMPLES) > SAMPLES / 2);
    model_free(&model);
}

/* The memory that a fit begins with is that of the key, where it has one. */
static void test_a_fit_takes_it(void) {
    double threshold_v[] = {5.0, 30.0, 60.0}, weight[] = {0.05, 0.0, 0.0, 0.0}, memory_v[3];
    const play_basis_t basis = {.operators = 3, .threshold_v = threshold_v};
    const linear_fit_t fit = {.weight = weight};
    recording_set_key(&part, "drive_before_v", before);
    (void)estimate_initial_memory(&basis, &fit, &part, SAMPLES, memory_v);
    /* Up to 130 V, down to -20 V, and up to 60 V again: u - r, unless that is below -20 + r, where it stays. */
    for (size_t i = 0; i < 3; i++) {
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, fmax(60.0 - threshold_v[i], -20.0 + threshold_v[i]), memory_v[i]);
    }
}

static void expect_refusal(const char *value, const char *why) {
    double before_v[RECORDING_MOST_BEFORE], position_um[SAMPLES];
    size_t points;
    model_t model;
    make_bank(&model);
    recording_set_key(&part, "drive_before_v", value);
    TEST_ASSERT_FALSE(recording_drive_before(&part, before_v, &points, &failure));
    expect_line(&failure, "part.csv: header key drive_before_v");
    expect_line(&failure, why);
    TEST_ASSERT_FALSE(chain_simulate(&model, &part, 0, position_um, &failure));
    expect_line(&failure, why);
    model_free(&model);
}

static void test_bad_keys_are_refused(void) {
    static const char *const bad[] = {"", "0,", "a, 5", "0, 1e9", "0, nan", ",", "0,,5"};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        expect_refusal(bad[i], "turning points");
    }
    expect_refusal("0 5", "comma");
    expect_refusal("1,2,3,4,5,6,7,8,9,10,11,12,13,14,15,16,17", "more than 16");
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_plays_begin_where_the_past_left_them);
    RUN_TEST(test_a_part_keeps_its_past);
    RUN_TEST(test_what_a_hysteresis_remembers);
    RUN_TEST(test_what_stands_in_front_acts_on_the_past);
    RUN_TEST(test_the_memory_is_determined);
    RUN_TEST(test_a_fit_takes_it);
    RUN_TEST(test_bad_keys_are_refused);
    return UNITY_END();
}
