/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Preisach model on the host: the block, and the amplifier's table that is compiled from it. */
#include "chain/catalogue.h"
#include "chain/chain.h"
#include "compile/compile.h"
#include "elements/preisach_grid.h"
#include "support.h"
#include "unity.h"
#include <gsl/gsl_math.h>
#include <stdio.h>
#include <stdlib.h>

enum { LEVELS = 9 };

static random_t rng;
static double level_v[LEVELS], table[LEVELS * (LEVELS - 1) / 2];

void setUp(void) {
}
void tearDown(void) {
}

/* Uneven levels from -20 V to 100 V and a table of random relays, all positive. */
static void make_table(void) {
    level_v[0] = -20.0;
    for (size_t i = 1; i < LEVELS; i++) {
        level_v[i] = level_v[i - 1] + 5.0 + 20.0 * random_unit(&rng);
    }
    for (size_t distance = 1; distance < LEVELS; distance++) {
        for (size_t j = 0; j + distance < LEVELS; j++) {
            const size_t i = j + distance;
            double sum = distance == 1 ? 0.5 + random_unit(&rng) : 0.3 * random_unit(&rng); /* um */
            if (distance > 1) {
                sum += table[preisach_element(i - 1, j)] + table[preisach_element(i, j + 1)];
                sum -= distance > 2 ? table[preisach_element(i - 1, j + 1)] : 0.0;
            }
            table[preisach_element(i, j)] = sum;
        }
    }
}

static void make_model(model_t *model, const double *past_v, size_t past) {
    model_block_t *block;
    model_create(model, 10000.0);
    block = model_append(model, &block_preisach);
    model_set_array(block, "levels_v", LEVELS, level_v, NULL);
    model_set_array(block, "everett_um", LEVELS * (LEVELS - 1) / 2, table, NULL);
    model_set(block, "offset_um", 3.0);
    model_set_array(block, "past_v", past, past_v, NULL);
}

static chain_t *open_model(const double *past_v, size_t past) {
    model_t model;
    chain_t *chain;
    failure_t failure = {{0}};
    make_model(&model, past_v, past);
    chain = chain_open(&model, 10000.0, 1, &failure);
    TEST_ASSERT_NOT_NULL_MESSAGE(chain, failure.text);
    model_free(&model);
    return chain;
}

static double any_drive(void) {
    return level_v[0] + (level_v[LEVELS - 1] - level_v[0]) * random_unit(&rng);
}

/*
 * Relays spread evenly over each square, and along the diagonal of each triangle, switched one by one: many of them,
 * so that the bilinear form comes out to within what one row of them weighs.
 */
static void test_is_a_sum_of_relays(void) {
    enum { PER = 24, GRID = PER * (LEVELS - 1) };
    static double up_v[GRID], weight[GRID][GRID];
    static bool up[GRID][GRID];
    chain_t *chain;
    double worst = 0.0;
    make_table();
    chain = open_model((const double[]){level_v[0]}, 1);
    for (size_t i = 0; i < GRID; i++) {
        const size_t a = i / PER;
        up_v[i] = level_v[a] + (level_v[a + 1] - level_v[a]) * ((double)(i % PER) + 0.5) / PER;
        for (size_t j = 0; j <= i; j++) {
            const size_t b = j / PER;
            const double corner = a > b ? table[preisach_element(a + 1, b)] : 0.0;
            up[i][j] = false;
            if (a == b) {
                weight[i][j] = i == j ? table[preisach_element(a + 1, a)] / PER : 0.0;
            } else {
                weight[i][j] = corner - table[preisach_element(a, b)] - table[preisach_element(a + 1, b + 1)];
                weight[i][j] += a > b + 1 ? table[preisach_element(a, b + 1)] : 0.0;
                weight[i][j] /= PER * PER;
            }
        }
    }
    for (int k = 0; k < 300; k++) {
        const double drive = any_drive();
        double sum = 3.0 - 0.5 * table[preisach_element(LEVELS - 1, 0)];
        for (size_t i = 0; i < GRID; i++) {
            for (size_t j = 0; j <= i; j++) {
                up[i][j] = drive > up_v[i] || (up[i][j] && drive > up_v[j]);
                sum += up[i][j] ? weight[i][j] : 0.0;
            }
        }
        if (k == 0) {
            chain_settle(chain, drive);
        }
        worst = fmax(worst, fabs(chain_step(chain, drive) - sum));
    }
    chain_close(chain);
    printf("worst difference from explicit relays: %.3g um\n", worst);
    /* Half a row on either side of the drive: 1.5 um of the triangle over PER, and 7 squares of 0.3 um over PER. */
    TEST_ASSERT_TRUE(worst <= 0.5 * (1.5 + 7 * 0.3) / PER * 1.2);
}

/* Both implementations, on even levels over the amplifier's full scale: double against fixed point. */
static void test_agrees_with_the_amplifier(void) {
    for (int run = 0; run < 20; run++) {
        const compile_options_t options = {.drive_range_v = {-20.0, 100.0}, .position_range_um = {-10.0, 16.0}};
        hyst_parameters_t parameters;
        compile_report_t report;
        static hyst_compensator_t compensator;
        static hyst_hysteresis_state_t state;
        failure_t failure = {{0}};
        model_t model;
        chain_t *chain;
        make_table();
        for (size_t i = 0; i < LEVELS; i++) {
            level_v[i] = -20.0 + 15.0 * (double)i;
        }
        make_model(&model, NULL, 0);
        TEST_ASSERT_TRUE_MESSAGE(compile_model(&model, &options, &parameters, &report, &failure), failure.text);
        TEST_ASSERT_EQUAL_UINT32(LEVELS - 1, parameters.preisach_intervals);
        TEST_ASSERT_DOUBLE_WITHIN(1e-7, 0.0, report.merge_error_um); /* 20 V / 2^31 at the ends of the range */
        TEST_ASSERT_EQUAL_INT(HYST_PARAMETERS_OK, hyst_parameters_build(&parameters, &compensator).error);
        chain = chain_open(&model, 10000.0, 1, &failure);
        chain_settle(chain, -20.0);
        chain_step(chain, 100.0);
        hyst_hysteresis_reset(&compensator.hysteresis, &state, HYST_Q31_MAX);
        for (int k = 0; k < 2000; k++) {
            const double u = -20.0 + 120.0 * random_unit(&rng);
            const hyst_q31_t drive = drive_from_volts(&parameters, u);
            double expected, got;
            hyst_hysteresis_advance(&compensator.hysteresis, &state, drive);
            got = position_to_micrometres(&parameters, hyst_hysteresis_output(&compensator.hysteresis, &state));
            expected = chain_step(chain, drive_to_volts(&parameters, drive));
            /* Elements to 2^-29 of 13 um each, at most four a branch and some forty branches; 1 V is 0.1 um. */
            TEST_ASSERT_DOUBLE_WITHIN(4.0 * 40.0 * 0x1p-29 * 13.0 + 1e-7, fmax(-10.0, fmin(16.0, expected)), got);
        }
        chain_close(chain);
        model_free(&model);
    }
}

/* A wider and a narrower converter range: the report's number is what a branch changes by, and the amplifier's branches
 * between limits keep it. */
static void test_other_levels(void) {
    static const double ranges[][2] = {{-23.0, 103.0}, {-40.0, 130.0}, {-10.0, 80.0}};
    for (size_t r = 0; r < 3; r++) {
        const compile_options_t options = {.drive_range_v = {ranges[r][0], ranges[r][1]},
                                           .position_range_um = {-13.0, 19.0}};
        hyst_parameters_t parameters;
        compile_report_t report;
        static hyst_compensator_t compensator;
        failure_t failure = {{0}};
        model_t model;
        preisach_grid_t grid = {LEVELS, level_v};
        double worst = 0.0;
        make_table();
        for (size_t i = 0; i < LEVELS; i++) {
            level_v[i] = -20.0 + 15.0 * (double)i;
        }
        make_model(&model, NULL, 0);
        model.fit = json_pack("{s:[f, f]}", "drive_range_v", fmax(-20.0, ranges[r][0]), fmin(100.0, ranges[r][1]));
        TEST_ASSERT_TRUE_MESSAGE(compile_model(&model, &options, &parameters, &report, &failure), failure.text);
        TEST_ASSERT_EQUAL_INT(HYST_PARAMETERS_OK, hyst_parameters_build(&parameters, &compensator).error);
        for (int k = 0; k < 20000; k++) {
            const hyst_q31_t to = random_between(&rng, parameters.drive_low, parameters.drive_high);
            const hyst_q31_t from = random_between(&rng, parameters.drive_low, parameters.drive_high);
            const double fixed =
                (double)hyst_preisach_everett(&compensator.hysteresis.preisach, to, from) * 0x1p-60 * 16.0;
            const double exact =
                preisach_everett(&grid, table, drive_to_volts(&parameters, to), drive_to_volts(&parameters, from));
            worst = fmax(worst, fabs(fixed - exact));
        }
        printf("drive range %g:%g V: branches change by %.3g um, reported %.3g um\n", ranges[r][0], ranges[r][1], worst,
               report.merge_error_um);
        TEST_ASSERT_TRUE(worst <=
                         report.merge_error_um + 1e-6); /* rounding of the table: 4 elements to 2^-29 of 16 um */
        TEST_ASSERT_TRUE(worst >= 0.5 * report.merge_error_um - 1e-6);
        TEST_ASSERT_TRUE(report.merge_error_um < 0.05 * table[preisach_element(LEVELS - 1, 0)]);
        model_free(&model);
    }
}

/* Outside the levels: straight on, without memory, and without a jump at the end. */
static void test_straight_outside_the_levels(void) {
    chain_t *chain;
    double top_um, slope;
    make_table();
    chain = open_model(NULL, 0);
    chain_settle(chain, 0.0);
    top_um = chain_step(chain, level_v[LEVELS - 1]);
    slope = table[preisach_element(LEVELS - 1, LEVELS - 2)] / (level_v[LEVELS - 1] - level_v[LEVELS - 2]);
    for (int k = 0; k < 100; k++) {
        const double beyond = 50.0 * random_unit(&rng);
        TEST_ASSERT_DOUBLE_WITHIN(1e-10, top_um + slope * beyond, chain_step(chain, level_v[LEVELS - 1] + beyond));
    }
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, top_um, chain_step(chain, level_v[LEVELS - 1]));
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, 3.0 + 0.5 * table[preisach_element(LEVELS - 1, 0)], top_um);
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, 3.0 - 0.5 * table[preisach_element(LEVELS - 1, 0)], chain_step(chain, level_v[0]));
    slope = table[preisach_element(1, 0)] / (level_v[1] - level_v[0]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, 3.0 - 0.5 * table[preisach_element(LEVELS - 1, 0)] - 7.0 * slope,
                              chain_step(chain, level_v[0] - 7.0));
    chain_close(chain);
}

/* The past is as good as samples before the first. */
static void test_past(void) {
    for (int run = 0; run < 50; run++) {
        double past_v[12];
        chain_t *with_past, *led;
        make_table();
        for (size_t k = 0; k < 12; k++) {
            past_v[k] = any_drive();
        }
        with_past = open_model(past_v, 12);
        led = open_model((const double[]){level_v[0]}, 1);
        chain_settle(led, past_v[0]);
        for (size_t k = 1; k < 12; k++) {
            chain_step(led, past_v[k]);
        }
        for (int k = 0; k < 20; k++) {
            const double drive = any_drive();
            if (k == 0) {
                chain_settle(with_past, drive);
            }
            TEST_ASSERT_EQUAL_DOUBLE(chain_step(led, drive), chain_step(with_past, drive));
        }
        chain_close(with_past);
        chain_close(led);
    }
}

/* More nested reversals than are remembered: the output moves by little, and a sweep heals it. */
static void test_many_reversals(void) {
    chain_t *chain, *fresh;
    double swing = 1.0;
    make_table();
    chain = open_model(NULL, 0);
    fresh = open_model(NULL, 0);
    chain_settle(chain, level_v[0]);
    chain_settle(fresh, level_v[0]);
    for (int k = 0; k < 3000; k++) {
        const double middle = 0.5 * (level_v[0] + level_v[LEVELS - 1]), half = 0.5 * (level_v[LEVELS - 1] - level_v[0]);
        TEST_ASSERT_TRUE(isfinite(chain_step(chain, middle + half * swing)));
        swing *= -0.998;
    }
    for (int k = 0; k < 5; k++) {
        const double drive = k == 0 ? level_v[LEVELS - 1] : any_drive();
        TEST_ASSERT_DOUBLE_WITHIN(1e-10, chain_step(fresh, drive), chain_step(chain, drive));
    }
    chain_close(chain);
    chain_close(fresh);
}

static void refused(const char *levels, const char *everett, const char *text) {
    char json_text[512];
    model_t model;
    failure_t failure = {{0}};
    json_t *json;
    snprintf(json_text, sizeof json_text,
             "{\"format\": \"hyst-model-1\", \"sample_rate_hz\": 1000, \"chain\": [{\"block\": \"preisach\", "
             "\"parameters\": {\"levels_v\": [%s], \"everett_um\": [%s], \"offset_um\": 0}}]}",
             levels, everett);
    json = json_loads(json_text, 0, NULL);
    TEST_ASSERT_NOT_NULL(json);
    TEST_ASSERT_FALSE(model_from_json(&model, json, "model", &failure));
    expect_line(&failure, text);
    json_decref(json);
}

static void test_refusals(void) {
    refused("1", "", "two levels");
    refused("1, 2, 2", "1, 1, 2", "levels_v[2] does not rise");
    refused("1, 2, 3", "1, 1", "2 values of everett_um for 3 levels, there must be 3");
}

/* The amplifier refuses what falls; so does compile, and says so. */
static void test_falling_branch_is_not_compiled(void) {
    const compile_options_t options = {.drive_range_v = {-20.0, 100.0}, .position_range_um = {-10.0, 16.0}};
    hyst_parameters_t parameters;
    failure_t failure = {{0}};
    model_t model;
    make_table();
    for (size_t i = 0; i < LEVELS; i++) {
        level_v[i] = -20.0 + 15.0 * (double)i;
    }
    table[preisach_element(5, 2)] = 0.9 * table[preisach_element(4, 2)];
    make_model(&model, NULL, 0);
    TEST_ASSERT_FALSE(compile_model(&model, &options, &parameters, NULL, &failure));
    expect_line(&failure, "preisach_everett, element 12"); /* 5 * 4 / 2 + 2 */
    model_free(&model);
}

int main(void) {
    rng = random_start("test_preisach", 20261121);
    UNITY_BEGIN();
    RUN_TEST(test_is_a_sum_of_relays);
    RUN_TEST(test_agrees_with_the_amplifier);
    RUN_TEST(test_other_levels);
    RUN_TEST(test_straight_outside_the_levels);
    RUN_TEST(test_past);
    RUN_TEST(test_many_reversals);
    RUN_TEST(test_refusals);
    RUN_TEST(test_falling_branch_is_not_compiled);
    return UNITY_END();
}
