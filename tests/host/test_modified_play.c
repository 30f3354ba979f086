/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Blocks of paper 001: the plane of plays against relays, the recursion, the amplifier, refusals. */
#include "compile/compile.h"
#include "elements/play_plane.h"
#include "elements/recursion.h"
#include "support.h"
#include "unity.h"
#include <gsl/gsl_math.h>
#include <string.h>

static const double rate_hz = 5000.0;
static const double mode[3] = {2.35, -1.95, 0.58}, harmonics[6] = {0.03, 0.0, 0.0, -0.05, 0.0, 0.0};
static failure_t failure;

void setUp(void) {
}
void tearDown(void) {
}

/* ---- the plane ---- */

/* A cell is the mean of its relays: +1 above center + r, -1 below center - r. 400 relays a cell and r, so the two
 * differ by half a relay, 1/400, at most. */
static void test_cells_are_means_of_relays(void) {
    enum { N = 4, CELLS = 6, RELAYS = 400 };
    static signed char relay[CELLS][RELAYS];
    double cell[CELLS];
    random_t random = random_start("cells", 901);
    play_plane_t plane;
    play_plane_open(&plane, N, 0.0, 0.0, rate_hz);
    memset(relay, -1, sizeof relay);
    for (int i = 0; i < 300; i++) {
        /* From -1, which sets every relay, from turning point to turning point. */
        const double u = i == 0 ? -1.0 : 2.0 * random_unit(&random) - 1.0;
        size_t c = 0;
        play_plane_step(&plane, u, cell);
        for (size_t row = 1; row < N; row++) {
            const double r = (double)row / N, width = 2.0 * (1.0 - r) / (double)(N - row);
            for (size_t j = 0; j < N - row; j++, c++) {
                double mean = 0.0;
                for (size_t k = 0; k < RELAYS; k++) {
                    const double p = -(1.0 - r) + width * ((double)j + ((double)k + 0.5) / RELAYS);
                    relay[c][k] = u > p + r ? 1 : u < p - r ? -1 : relay[c][k];
                    mean += relay[c][k] / (double)RELAYS;
                }
                TEST_ASSERT_DOUBLE_WITHIN(1.0001 / RELAYS, mean, cell[c]);
            }
        }
    }
}

static void test_envelope_takes_the_rate_known_before(void) {
    double cell[1];
    play_plane_t plane;
    play_plane_open(&plane, 2, 2.0 / rate_hz, 1.0 / rate_hz, rate_hz); /* alpha 2 samples, beta 1 */
    play_plane_settle(&plane, 0.0, cell);
    play_plane_step(&plane, 0.9, cell); /* rate before: 0 */
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, 0.4, plane.play[0]);
    play_plane_step(&plane, 1.0, cell); /* rate before: 0.9, so the lower bound is 1 - 1.8 - 0.5 */
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, 0.4, plane.play[0]);
    play_plane_step(&plane, -0.3, cell); /* 0.1: the upper bound is -0.3 + 0.1 + 0.5 */
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, 0.3, plane.play[0]);
}

/* ---- the recursion ---- */

/* Under the sine that they are identified with, the terms for odd harmonics hold none: only the mean and even ones. */
static void test_odd_harmonic_terms_hold_even_harmonics_only(void) {
    enum { SAMPLES = 240 };
    for (size_t term = 0; term < RECURSION_HARMONICS; term++) {
        for (int harmonic = 1; harmonic <= 7; harmonic++) {
            double s = 0.0, c = 0.0;
            for (int k = 0; k < SAMPLES; k++) {
                const double angle = 2.0 * M_PI * k / SAMPLES;
                double product[RECURSION_HARMONICS];
                recursion_harmonics(sin(angle), angle, product);
                s += 2.0 / SAMPLES * product[term] * sin(harmonic * angle);
                c += 2.0 / SAMPLES * product[term] * cos(harmonic * angle);
            }
            if (harmonic % 2 == 1) {
                TEST_ASSERT_DOUBLE_WITHIN(1e-14, 0.0, hypot(s, c));
            } else if (harmonic == 2) {
                TEST_ASSERT_TRUE(hypot(s, c) > 0.1);
            }
        }
    }
}

/* Against the roots: a margin above 0 says that all are inside the unit circle, for both ends of the drive. */
static void test_margin_is_where_roots_leave_the_circle(void) {
    random_t random = random_start("margin", 902);
    int stable = 0;
    for (int i = 0; i < 20000; i++) {
        const double c[3] = {6.0 * random_unit(&random) - 3.0, 6.0 * random_unit(&random) - 3.0,
                             2.4 * random_unit(&random) - 1.2};
        /* Response to an impulse after 3000 samples: roots within 0.3 % of the circle are left to chance. */
        double past[3] = {1.0, 0.0, 0.0}, size = 0.0;
        const double margin = recursion_margin(c, 0.0);
        if (fabs(margin) < 0.02) {
            continue;
        }
        for (int k = 0; k < 3000 && size < 1e100; k++) {
            const double y = c[0] * past[0] + c[1] * past[1] + c[2] * past[2];
            past[2] = past[1];
            past[1] = past[0];
            past[0] = y;
            size = fabs(past[0]) + fabs(past[1]) + fabs(past[2]);
        }
        TEST_ASSERT_EQUAL_MESSAGE(margin > 0.0, size < 1.0, "margin");
        stable += margin > 0.0;
    }
    TEST_ASSERT_GREATER_THAN(500, stable);
    const double lag[3] = {0.5, 0.0, 0.0};
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, 0.1, recursion_margin(lag, -0.4));
    TEST_ASSERT_TRUE(recursion_margin(lag, 0.51) < 0.0);
}

/* ---- interleaved_hysteresis ---- */

static void test_interleaved_hysteresis_multiplies_last_position_and_drive(void) {
    const double weight[] = {0.5, 0.3}, threshold[] = {20.0}, g = 0.4;
    model_t plain, interleaved;
    double past = 0.0, past_u = 0.0;
    random_t random = random_start("interleaved", 906);
    make_bank_model(&plain, rate_hz, 1.0, 1, weight, threshold);
    model_copy(&interleaved, &plain);
    model_block_t *block = model_append(&interleaved, &block_interleaved_hysteresis);
    model_set(block, "bilinear_gain", g);
    model_set(block, "center_v", 10.0);
    model_set(block, "half_range_v", 50.0);
    chain_t *a = chain_open(&plain, rate_hz, 0, &failure), *b = chain_open(&interleaved, rate_hz, 0, &failure);
    TEST_ASSERT_NOT_NULL(a);
    TEST_ASSERT_NOT_NULL_MESSAGE(b, failure.text);
    /* At rest y = h + g u y. */
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, chain_settle(a, 35.0) / (1.0 - g * 0.5), past = chain_settle(b, 35.0));
    past_u = 0.5;
    for (int k = 0; k < 1000; k++) {
        const double drive = 10.0 + 120.0 * (random_unit(&random) - 0.5), y = chain_step(b, drive);
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, chain_step(a, drive) + g * past * past_u, y);
        past = y;
        past_u = fmax(-1.0, fmin(1.0, (drive - 10.0) / 50.0)); /* beyond the range it stays stable */
    }
    chain_close(a);
    chain_close(b);
    model_free(&plain);
    model_free(&interleaved);
}

/* ---- in the amplifier ---- */

/* The compiled model in lib/hyst against the simulated chain. Coefficients are rounded to Q28; near the unit circle
 * (least slack of this filter: 0.02) that moves the gain by some 2^-29 / 0.02 = 1e-7, and there are some hundred of
 * them. */
static void test_amplifier_runs_the_same_model(void) {
    const compile_options_t options = {.drive_range_v = {-75.0, 75.0}, .position_range_um = {-300.0, 300.0}};
    random_t random = random_start("amplifier", 908);
    hyst_parameters_t image;
    hyst_modified_play_t model;
    hyst_modified_play_state_t state;
    model_t truth;
    uint32_t element;
    double worst = 0.0, largest = 0.0;
    make_modified_play_model(&truth, rate_hz, 0.001, 40.0);
    TEST_ASSERT_TRUE_MESSAGE(compile_model(&truth, &options, &image, NULL, &failure), failure.text);
    TEST_ASSERT_EQUAL(HYST_FAMILY_MODIFIED_PLAY, image.family);
    TEST_ASSERT_EQUAL(HYST_MODIFIED_PLAY_OK, hyst_modified_play_build(&model, &image.modified_play[0], &element));
    hyst_modified_play_reset(&model, &state, 0);
    /* The image's phase is for a source that begins; here it is the model's, at the sample before the first. */
    const double turns = model_parameter(&truth.block[0], "phase_rad")->value[0] / (2.0 * M_PI);
    hyst_modified_play_set_phase(&model, &state,
                                 (uint32_t)llrint(ldexp(turns - floor(turns), 32)) - image.modified_play[0].phase_step);
    chain_t *chain = chain_open(&truth, rate_hz, 0, &failure);
    TEST_ASSERT_NOT_NULL_MESSAGE(chain, failure.text);
    chain_settle(chain, 0.0);
    for (int k = 0; k < 20000; k++) {
        const hyst_q31_t drive = random_q31(&random);
        const double y = chain_step(chain, 75.0 * ldexp((double)drive, -31));
        worst = fmax(worst, fabs(300.0 * ldexp((double)hyst_modified_play_forward(&model, &state, drive), -31) - y));
        largest = fmax(largest, fabs(y));
    }
    TEST_ASSERT_TRUE(largest > 30.0 && largest < 300.0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-5 * largest, 0.0, worst);
    chain_close(chain);
    model_free(&truth);
}

static void expect_uncompiled(const model_t *model, const compile_options_t *options, const char *text) {
    hyst_parameters_t image;
    TEST_ASSERT_FALSE(compile_model(model, options, &image, NULL, &failure));
    expect_line(&failure, text);
}

static void test_compile_refuses_what_the_amplifier_cannot_run(void) {
    const compile_options_t wide = {.drive_range_v = {-120.0, 125.0}, .position_range_um = {-300.0, 300.0}};
    const compile_options_t uneven = {.drive_range_v = {-75.0, 75.0}, .position_range_um = {-200.0, 300.0}};
    const compile_options_t good = {.drive_range_v = {-75.0, 75.0}, .position_range_um = {-300.0, 300.0}};
    const double strong[6] = {3.0, 0.0, 0.0, 0.0, 0.0, 0.0};
    double many[17 * 8] = {0.0};
    model_t model;
    make_modified_play_model(&model, rate_hz, 0.006, 40.0);
    expect_uncompiled(&model, &wide, "give a smaller --drive-range");
    expect_uncompiled(&model, &uneven, "whose middle is 0 um");
    model_set_array(&model.block[0], "harmonics_um", 6, strong, NULL); /* more than direct_um bears */
    expect_uncompiled(&model, &good, "modified_play");
    model_set_array(&model.block[0], "harmonics_um", 6, harmonics, NULL);
    model_set_array(&model.block[0], "cells_um", 17 * 8, many, NULL);
    expect_uncompiled(&model, &good, "the amplifier has 16");
    model_free(&model);
}

/* ---- refusals ---- */

static void expect_refusal(model_t *model, const char *name, size_t count, const double *value, const char *text) {
    model_set_array(&model->block[0], name, count, value, NULL);
    TEST_ASSERT_FALSE(model_check(model, "model", &failure));
    expect_line(&failure, text);
}

static void test_blocks_refuse_what_they_cannot_be(void) {
    const double unstable[3] = {2.1, -1.0, 0.0}, seven[7] = {0.0};
    model_t model;
    make_modified_play_model(&model, rate_hz, 0.0, 20.0);
    TEST_ASSERT_TRUE(model_check(&model, "model", &failure));
    TEST_ASSERT_NULL(chain_open(&model, 1000.0, 0, &failure));
    expect_line(&failure, "holds at no other sample rate");
    expect_refusal(&model, "feedback", 3, unstable, "run away");
    expect_refusal(&model, "feedback", 2, unstable, "instead of 3");
    model_set_array(&model.block[0], "feedback", 3, mode, NULL);
    expect_refusal(&model, "harmonics_um", 5, seven, "instead of 6");
    model_set_array(&model.block[0], "harmonics_um", 6, harmonics, NULL);
    expect_refusal(&model, "cells_um", 7, seven, "N (N - 1) / 2");
    model_free(&model);
    model_create(&model, rate_hz);
    model_block_t *block = model_append(&model, &block_interleaved_hysteresis);
    model_set(block, "half_range_v", 1.0);
    block = model_append(&model, &block_bouc_wen);
    model_set(block, "half_range_v", 1.0);
    TEST_ASSERT_FALSE(model_check(&model, "model", &failure));
    expect_line(&failure, "stands before the hysteresis");
    model_free(&model);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_cells_are_means_of_relays);
    RUN_TEST(test_envelope_takes_the_rate_known_before);
    RUN_TEST(test_odd_harmonic_terms_hold_even_harmonics_only);
    RUN_TEST(test_margin_is_where_roots_leave_the_circle);
    RUN_TEST(test_interleaved_hysteresis_multiplies_last_position_and_drive);
    RUN_TEST(test_amplifier_runs_the_same_model);
    RUN_TEST(test_compile_refuses_what_the_amplifier_cannot_run);
    RUN_TEST(test_blocks_refuse_what_they_cannot_be);
    return UNITY_END();
}
