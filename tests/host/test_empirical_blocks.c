/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The blocks that describe what no physical effect explains, each against its equation, and against its inverse. */
#include "compile/compile.h"
#include "compile/compile_filters.h"
#include "elements/second_order.h"
#include "support.h"
#include "unity.h"
#include <gsl/gsl_math.h>
#include <math.h>
#include <string.h>

static failure_t failure;

void setUp(void) {
}
void tearDown(void) {
}

/* A natural spline through sin(x) from 0 to pi, whose ends are not bent: 5/384 of the interval's fourth power. */
static void test_a_trend_goes_smoothly_through_its_values(void) {
    enum { PER_KNOT = 100, KNOTS = 8 };
    const double bound = 5.0 / 384.0 * gsl_pow_4(M_PI / KNOTS);
    double value[KNOTS + 1], worst = 0.0;
    for (size_t i = 0; i < KNOTS; i++) {
        value[i] = sin(M_PI * (double)(i + 1) / KNOTS);
    }
    value[KNOTS] = KNOTS * PER_KNOT / 1000.0; /* duration */
    chain_t *chain = open_block(&block_empirical_trend, value, 1000.0, 1);
    (void)chain_settle(chain, 0.0);
    for (size_t k = 0; k <= KNOTS * PER_KNOT; k++) {
        const double error = fabs(chain_step(chain, 0.0) - sin(M_PI * (double)k / (KNOTS * PER_KNOT)));
        TEST_ASSERT_TRUE(k % PER_KNOT != 0 || error < 1e-9);
        worst = fmax(worst, error);
    }
    TEST_ASSERT_TRUE(worst <= bound && worst > 0.1 * bound);
    for (size_t k = 0; k < PER_KNOT; k++) { /* what was last stays */
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, value[KNOTS - 1], chain_step(chain, 0.0));
    }
    chain_close(chain);
}

/* Knots of 0.5 um from 0 to 4 um. */
static const double bent[] = {0.05, 0.10, 0.05, -0.05, -0.10, -0.05, 0.02, 2.0, 2.0};

static void test_a_curve_has_its_values_and_goes_on_straight(void) {
    chain_t *chain = open_block(&block_empirical_curve, bent, 1000.0, 1);
    (void)chain_settle(chain, 0.0);
    for (size_t i = 0; i < 7; i++) {
        const double at = 0.5 * (double)(i + 1);
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, at + bent[i], chain_step(chain, at));
    }
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.0, chain_step(chain, 0.0));
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 4.0, chain_step(chain, 4.0));
    const double below = chain_step(chain, -1.0), further = chain_step(chain, -2.0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 2.0 * below, further);
    TEST_ASSERT_TRUE(fabs(below + 1.0) > 0.01); /* with the slope that it has at the end */
    chain_close(chain);
}

static void make_model(model_t *model, const block_t *block, const double *value) {
    const double weights[] = {0.04}, unused = 0.0;
    model_t hysteresis;
    make_bank_model(&hysteresis, 10000.0, 0.0, 0, weights, &unused);
    insert_block(model, &hysteresis, block, value);
    model_free(&hysteresis);
}

static void test_a_curve_that_falls_is_refused(void) {
    double value[9];
    model_t model;
    memcpy(value, bent, sizeof bent);
    value[2] = -0.5;
    make_model(&model, &block_empirical_curve, value);
    TEST_ASSERT_FALSE(model_check(&model, "model", &failure));
    expect_line(&failure, "block empirical_curve: with these values the reading falls where the position rises");
    model_free(&model);
}

static const compile_options_t ranges = {.drive_range_v = {0.0, 100.0}, .position_range_um = {0.0, 4.0}};

/* At its nodes the compiled curve is the inverse: the reading there is the node's. */
static void test_a_compiled_curve_is_undone(void) {
    model_t model;
    hyst_parameters_t p;
    compile_report_t report;
    make_model(&model, &block_empirical_curve, bent);
    TEST_ASSERT_TRUE_MESSAGE(compile_model(&model, &ranges, &p, &report, &failure), failure.text);
    TEST_ASSERT_EQUAL_UINT32(1, p.reference_curves);
    TEST_ASSERT_EQUAL_UINT64(0, report.uncorrected);
    const double last = 4.0; /* both ends stay: the positions are 0 to 4 um, too */
    chain_t *chain = open_block(&block_empirical_curve, bent, 1000.0, 1);
    (void)chain_settle(chain, 0.0);
    double moved = 0.0;
    for (int i = 0; i < HYST_CURVE_INTERVALS; i++) {
        const double reading = last * i / HYST_CURVE_INTERVALS;
        const double position = 0.5 * last * (1.0 + 0x1p-31 * p.reference_curve->node[i]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-8, reading, chain_step(chain, position));
        moved = fmax(moved, fabs(position - reading));
    }
    TEST_ASSERT_TRUE(moved > 0.05);
    chain_close(chain);
    const compile_options_t follow = {
        .drive_range_v = {0.0, 100.0}, .position_range_um = {0.0, 4.0}, .follow_position = true};
    TEST_ASSERT_TRUE_MESSAGE(compile_model(&model, &follow, &p, &report, &failure), failure.text);
    TEST_ASSERT_EQUAL_UINT32(0, p.reference_curves);
    TEST_ASSERT_EQUAL_STRING("empirical_curve", report.uncorrected_block[0].block);
    model_free(&model);
}

/* frequency, damping, numerator */
static const double filters[][4] = {
    {100.0, 0.1, 0.5, 0.3}, {40.0, 2.0, -1.5, 0.0}, {300.0, 0.7, 0.4, -0.6}, {4000.0, 0.5, -0.2, 0.1}};

/* A sine at the filter's own frequency, where the transform is exact, p = j. */
static void test_a_filter_answers_as_its_equation_does(void) {
    enum { COUNT = 20000 };
    static double x[COUNT];
    const double rate = 20000.0;
    const block_t *const blocks[] = {&block_empirical_filter, &block_empirical_drive_filter};
    for (size_t i = 0; i < 8; i++) {
        const double *f = filters[i % 4];
        double in_phase = 0.0, quadrature = 0.0;
        for (size_t k = 0; k < COUNT; k++) {
            x[k] = 1.0 + sin(2.0 * M_PI * f[0] * (double)k / rate);
        }
        pass_block(blocks[i / 4], f, rate, COUNT, x);
        for (size_t k = COUNT / 2; k < COUNT; k++) {
            const double angle = 2.0 * M_PI * f[0] * (double)k / rate;
            in_phase += (x[k] - 1.0) * sin(angle) * 4.0 / COUNT;
            quadrature += (x[k] - 1.0) * cos(angle) * 4.0 / COUNT;
        }
        /* 1 + (j first - second) / (2 j damping) */
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, 1.0 + f[2] / (2.0 * f[1]), in_phase);
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, f[3] / (2.0 * f[1]), quadrature);
    }
}

static second_order_t made(const double *filter, double rate) {
    double number[4];
    parameter_t parameter[4];
    memcpy(number, filter, sizeof number);
    for (size_t i = 0; i < 4; i++) {
        parameter[i] = (parameter_t){.count = 1, .value = &number[i]};
    }
    return second_order_make(parameter, rate);
}

/* Behind the block its inverse gives back what went in. */
static void test_a_filter_and_its_inverse_are_nothing(void) {
    enum { COUNT = 4000 };
    static double x[COUNT], y[COUNT];
    random_t random = random_start("empirical filters", 7);
    for (size_t i = 0; i < 4; i++) {
        const second_order_t filter = made(filters[i], 10000.0);
        inverse_filter_t inverse;
        TEST_ASSERT_TRUE(invert_second_order(&filter, 10000.0, false, &inverse));
        TEST_ASSERT_TRUE(inverse.section);
        TEST_ASSERT_EQUAL_DOUBLE(0.0, inverse.delay_s);
        double in[2] = {0.0}, out[2] = {0.0};
        for (size_t k = 0; k < COUNT; k++) {
            x[k] = y[k] = k == 0 ? 0.0 : random_normal(&random);
        }
        pass_block(&block_empirical_filter, filters[i], 10000.0, COUNT, y);
        for (size_t k = 0; k < COUNT; k++) {
            const double back =
                inverse.b0 * y[k] + inverse.b1 * in[0] + inverse.b2 * in[1] - inverse.a1 * out[0] - inverse.a2 * out[1];
            TEST_ASSERT_DOUBLE_WITHIN(1e-9, x[k], back);
            in[1] = in[0];
            in[0] = y[k];
            out[1] = out[0];
            out[0] = back;
        }
    }
}

static void compile_filter(const block_t *block, const double *value, bool no_filters, hyst_parameters_t *p,
                           compile_report_t *report) {
    compile_options_t options = ranges;
    model_t model;
    options.no_filters = no_filters;
    make_model(&model, block, value);
    TEST_ASSERT_TRUE_MESSAGE(compile_model(&model, &options, p, report, &failure), failure.text);
    model_free(&model);
}

/* A low pass of second order has no inverse without a roll-off: it is left, and named. */
static void test_a_compiled_filter_is_undone_or_named(void) {
    static const double low_pass[] = {100.0, 0.7, -1.0, -1.0};
    const block_t *const blocks[] = {&block_empirical_filter, &block_empirical_drive_filter};
    hyst_parameters_t p;
    compile_report_t report;
    for (size_t i = 0; i < 2; i++) {
        compile_filter(blocks[i], filters[0], false, &p, &report);
        TEST_ASSERT_EQUAL_UINT32(i == 0 ? 1 : 0, p.shape_sections);
        TEST_ASSERT_EQUAL_UINT32(i == 0 ? 0 : 1, p.equalise_sections);
        TEST_ASSERT_EQUAL_UINT64(0, report.uncorrected);
        compile_filter(blocks[i], low_pass, false, &p, &report);
        TEST_ASSERT_EQUAL_UINT32(0, p.shape_sections + p.equalise_sections);
        TEST_ASSERT_EQUAL_UINT64(1, report.uncorrected);
        TEST_ASSERT_EQUAL_STRING(blocks[i]->name, report.uncorrected_block[0].block);
        TEST_ASSERT_NOT_NULL(strstr(report.uncorrected_block[0].why, "no stable filter"));
    }
    /* Without filters its delay is looked ahead: 1.5 / (2 pi 40 Hz), 59.7 samples. */
    compile_filter(&block_empirical_filter, filters[1], true, &p, &report);
    TEST_ASSERT_EQUAL_UINT32(60, p.lookahead_samples);
}

/* None is a name: the search does not know them, and nothing is confused with them. */
static void test_what_is_empirical_is_not_looked_for(void) {
    size_t empirical = 0;
    for (size_t i = 0; i < catalogue_count; i++) {
        const block_t *block = catalogue[i];
        const bool by_name = strncmp(block->name, "empirical_", 10) == 0;
        TEST_ASSERT_EQUAL_INT_MESSAGE(by_name, block->empirical != NULL, block->name);
        TEST_ASSERT_TRUE_MESSAGE(block->empirical == NULL || block->probe == NULL, block->name);
        empirical += by_name ? 1 : 0;
    }
    TEST_ASSERT_TRUE(empirical >= 4);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_trend_goes_smoothly_through_its_values);
    RUN_TEST(test_a_curve_has_its_values_and_goes_on_straight);
    RUN_TEST(test_a_curve_that_falls_is_refused);
    RUN_TEST(test_a_compiled_curve_is_undone);
    RUN_TEST(test_a_filter_answers_as_its_equation_does);
    RUN_TEST(test_a_filter_and_its_inverse_are_nothing);
    RUN_TEST(test_a_compiled_filter_is_undone_or_named);
    RUN_TEST(test_what_is_empirical_is_not_looked_for);
    return UNITY_END();
}
