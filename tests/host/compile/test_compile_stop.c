/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Stop form, inertia and preload in the amplifier: the reference comes out of the model that was compiled. */
#include "chain/catalogue.h"
#include "compile/compile.h"
#include "support.h"
#include "unity.h"
#include <gsl/gsl_math.h>
#include <stdio.h>

enum { STOPS = 4 };

static const double weights[STOPS + 1] = {2.0, 0.8, 0.5, 0.4, 0.3}, thresholds[STOPS] = {1.0, 2.0, 3.0, 4.0};
static const double damping = 1.1e-3, mass = 6e-9, rate_hz = 10000.0; /* a lag at 580 Hz, a mode at 4 kHz */

void setUp(void) {
}
void tearDown(void) {
}

static model_block_t *append_spring(model_t *model, const block_t *block) {
    model_block_t *spring = model_append(model, block);
    model_set(spring, "offset_v", 1.5);
    model_set_array(spring, "weights", STOPS + 1, weights, NULL);
    model_set_array(spring, "thresholds_um", STOPS, thresholds, NULL);
    return spring;
}

/*
 * Worst error of the position in the last tenth of a second, of the amplitude: 5 +- 5 um at this frequency, after the
 * drive's whole range has been swept, which gives the model and the compensator one memory.
 */
static double track(const model_t *model, double frequency_hz, double preload_n, uint32_t *sections) {
    const double rate = model->sample_rate_hz;
    const int sweep = (int)(0.04 * rate), samples = (int)(0.3 * rate);
    const compile_options_t options = {
        .drive_range_v = {-40.0, 80.0}, .position_range_um = {-8.0, 16.0}, .preload_n = preload_n};
    static hyst_compensator_t compensator;
    static hyst_compensator_state_t state;
    hyst_parameters_t parameters;
    compile_report_t report;
    failure_t failure = {{0}};
    double worst = 0.0;
    TEST_ASSERT_TRUE_MESSAGE(compile_model(model, &options, &parameters, &report, &failure), failure.text);
    TEST_ASSERT_EQUAL_INT(HYST_PARAMETERS_OK, hyst_parameters_build(&parameters, &compensator).error);
    const double delay = parameters.lookahead_samples + report.lookahead_remainder_s * rate;
    chain_t *chain = chain_open_preloaded(model, rate, 1, preload_n, &failure);
    TEST_ASSERT_NOT_NULL_MESSAGE(chain, failure.text);
    hyst_compensator_reset(&compensator, &state);
    chain_settle(chain, 0.0);
    for (int k = 0; k < sweep + samples; k++) {
        const double phase = 2.0 * M_PI * frequency_hz / rate, y = 5.0 - 5.0 * cos(phase * (k - sweep));
        const hyst_q31_t swept = k < sweep / 4 ? parameters.drive_low : parameters.drive_high;
        unsigned events;
        const hyst_q31_t drive = k < sweep / 2
                                     ? hyst_compensator_step(&compensator, &state, HYST_MODE_DIRECT, swept, &events)
                                     : hyst_compensator_step(&compensator, &state, HYST_MODE_COMPENSATE,
                                                             position_from_micrometres(&parameters, y), &events);
        const double position = chain_step(chain, drive_to_volts(&parameters, drive));
        if (k >= sweep + samples - samples / 3) {
            TEST_ASSERT_EQUAL_UINT(0, events);
            worst = fmax(worst, fabs(position - (5.0 - 5.0 * cos(phase * (k - sweep - delay)))) / 5.0);
        }
    }
    *sections = parameters.inertia_sections;
    chain_close(chain);
    return worst;
}

static void test_stop_form_is_inverted_to_rounding(void) {
    model_t model;
    uint32_t sections;
    model_create(&model, rate_hz);
    append_spring(&model, &block_stop_prandtl_ishlinskii);
    const double worst = track(&model, 50.0, 0.0, &sections);
    printf("stop form: worst error %.2g of the amplitude\n", worst);
    TEST_ASSERT_EQUAL_UINT32(0, sections);
    TEST_ASSERT_TRUE(worst < 3e-8); /* weights and thresholds rounded to 2^-28 and 2^-31 of full scale, five of them */
    model_free(&model);
}

static void test_mass_and_damping_are_driven_for(void) {
    double with[2], without;
    uint32_t sections;
    model_t model;
    for (int i = 0; i < 2; i++) {
        model_create(&model, rate_hz);
        model_block_t *block = append_spring(&model, &block_inertial_hysteresis);
        model_set(block, "damping_v_s_per_um", damping);
        model_set(block, "mass_v_s2_per_um", mass);
        with[i] = track(&model, i == 0 ? 50.0 : 200.0, 0.0, &sections);
        TEST_ASSERT_EQUAL_UINT32(1, sections);
        model_free(&model);
    }
    /* What the spring's inverse alone leaves: the lag. */
    without = 2.0 * M_PI * 200.0 * damping / (weights[0] + weights[1]);
    printf("inertial form: worst error %.4f %% at 50 Hz, %.4f %% at 200 Hz of the amplitude; lag without %.1f %%\n",
           100.0 * with[0], 100.0 * with[1], 100.0 * without);
    /* The rate's differences are off by (w dt)^2 / 3 + 1 / 12 of the trapezoidal rule's, the acceleration is late by
     * one sample: 0.42 * 0.0158 * 0.5 + 0.0025 * 0.126 = 0.4 % at 200 Hz, and a sixteenth at 50 Hz times a quarter of
     * the lag. */
    TEST_ASSERT_TRUE(with[1] < 0.006);
    TEST_ASSERT_TRUE(with[0] < 0.0003);
}

/* The straight line of a mode that rings at 15 Hz is that of its spring, whatever the loop's rate. */
static void test_the_straight_line_is_that_of_a_slow_loop(void) {
    const compile_options_t options = {.drive_range_v = {-40.0, 80.0}, .position_range_um = {-8.0, 16.0}};
    int32_t still[2] = {0};
    for (int i = 0; i < 4; i++) {
        static const double rates_hz[] = {2000.0, 2000.0, 20000.0, 40000.0};
        model_t model;
        hyst_parameters_t parameters;
        compile_report_t report;
        failure_t failure = {{0}};
        model_create(&model, rates_hz[i]);
        model_block_t *block = append_spring(&model, &block_inertial_hysteresis);
        model_set(block, "damping_v_s_per_um", i == 0 ? 0.0 : 0.025);
        model_set(block, "mass_v_s2_per_um", i == 0 ? 0.0 : 3.3e-4); /* of 3.0 V/um */
        TEST_ASSERT_TRUE_MESSAGE(compile_model(&model, &options, &parameters, &report, &failure), failure.text);
        if (i == 0) {
            still[0] = parameters.linear_gain;
            still[1] = parameters.linear_offset;
        }
        /* Of the damping 10^-9 V/um are left, beside 3 of the spring: less than a unit, and another of rounding. */
        TEST_ASSERT_INT32_WITHIN(2, still[0], parameters.linear_gain);
        TEST_ASSERT_INT32_WITHIN(4, still[1], parameters.linear_offset);
        model_free(&model);
    }
}

/* More than the number format holds: rolled off, and late, but not refused. */
static void test_a_large_damping_is_rolled_off(void) {
    uint32_t sections;
    model_t model;
    model_create(&model, rate_hz);
    model_block_t *block = append_spring(&model, &block_inertial_hysteresis);
    model_set(block, "damping_v_s_per_um", 8.0 * damping); /* a lag at 70 Hz */
    const double worst = track(&model, 20.0, 0.0, &sections), lag = 2.0 * M_PI * 20.0 * 8.0 * damping / 2.8;
    printf("large damping: worst error %.3f %% of the amplitude at 20 Hz, lag without %.1f %%\n", 100.0 * worst,
           100.0 * lag);
    TEST_ASSERT_EQUAL_UINT32(1, sections);
    TEST_ASSERT_TRUE(worst < 0.1 * lag);
    model_free(&model);
}

/* A mode at 60 Hz with a damping ratio of 0.5, driven at 15 Hz, whatever the rate of the loop. Mass and damper take
 * 1 - r^2 + 2 0.5 r i with r = 1/4 of the spring's drive, less 1: 0.26. What the feedforward leaves of that is its
 * delay, once the number format rolls it off: 2 0.7 / (2 pi f) with f = 60 Hz sqrt(11.5 / 4) = 102 Hz, or 2.2 ms, which
 * is 0.21 of a radian at 15 Hz: 0.054, and a tenth more for what else is neglected here. */
static void test_the_roll_off_does_not_depend_on_the_rate(void) {
    const double stiffness = weights[0] + weights[1], mode = 2.0 * M_PI * 60.0;
    for (int octave = 0; octave < 5; octave++) {
        const double rate = ldexp(2000.0, octave);
        uint32_t sections;
        model_t model;
        model_create(&model, rate);
        model_block_t *block = append_spring(&model, &block_inertial_hysteresis);
        model_set(block, "damping_v_s_per_um", stiffness / mode);
        model_set(block, "mass_v_s2_per_um", stiffness / gsl_pow_2(mode));
        const double worst = track(&model, 15.0, 0.0, &sections);
        printf("mode at 60 Hz, loop at %g Hz: worst error %.3f %% of the amplitude at 15 Hz\n", rate, 100.0 * worst);
        TEST_ASSERT_TRUE(worst < 0.06);
        model_free(&model);
    }
}

static void test_play_form_is_undone_as_a_mode_or_two_lags(void) {
    const double c[] = {3e-4, 3e-5}, m[] = {1.6e-9, 6e-9}, one = 0.2; /* lags at 560 Hz and 28 kHz; a mode at 2 kHz */
    for (int i = 0; i < 2; i++) {
        uint32_t sections;
        model_t model;
        model_create(&model, rate_hz);
        model_set_array(model_append(&model, &block_prandtl_ishlinskii), "weights", 1, &one, NULL);
        model_block_t *block = model_append(&model, &block_inertial_terms);
        model_set(block, "damping_s", c[i]);
        model_set(block, "mass_s2", m[i]);
        const double worst = track(&model, 50.0, 0.0, &sections), lag = 2.0 * M_PI * 50.0 * c[i];
        printf("play form: worst error %.3f %% of the amplitude at 50 Hz, lag %.1f %%\n", 100.0 * worst, 100.0 * lag);
        /* The square of the lag is what the expansion leaves; half a percent for the roll-off. */
        TEST_ASSERT_TRUE(worst < lag * lag + 0.005);
        model_free(&model);
    }
}

static void test_preload_is_made_up_for(void) {
    model_t model;
    uint32_t sections;
    model_create(&model, rate_hz);
    append_spring(&model, &block_stop_prandtl_ishlinskii);
    model_set(model_append(&model, &block_creep), "gamma_per_decade", 0.0);
    model_block_t *block = model_append(&model, &block_preload);
    model_set(block, "compliance_per_n", 0.01);
    model_set(block, "shift_um_per_n", 0.02);
    model_set(block, "spring_n_per_um", 1.0);
    TEST_ASSERT_TRUE(track(&model, 50.0, 12.0, &sections) < 5e-8);
    model_free(&model);
}

/* Creep stands before the preload: the middle of the range has to pass both the right way round. */
static void test_preload_and_creep_keep_the_middle(void) {
    compile_options_t options = {.drive_range_v = {-40.0, 80.0}, .position_range_um = {-8.0, 16.0}};
    const double gamma = 0.02, at_rest = 1.0 + 9.0 * gamma / 2.0; /* cells at 0.1 s to 1000 s */
    model_t with, without;
    hyst_parameters_t parameters[2];
    failure_t failure = {{0}};
    for (int i = 0; i < 2; i++) {
        model_t *model = i == 0 ? &with : &without;
        options.preload_n = i == 0 ? 10.0 : 0.0; /* of a block that only one has */
        model_create(model, rate_hz);
        model_block_t *spring = append_spring(model, &block_stop_prandtl_ishlinskii);
        if (i == 0) { /* position 4 um + 1 um of shift is 5 um / 1.09 before creep */
            model_set(model_append(model, &block_creep), "gamma_per_decade", gamma);
            model_set(model_append(model, &block_preload), "shift_um_per_n", 0.1);
        } else {
            model_set(spring, "offset_v", 1.5 + weights[0] * ((4.0 + 1.0) / at_rest - 4.0));
        }
        TEST_ASSERT_TRUE_MESSAGE(compile_model(model, &options, &parameters[i], NULL, &failure), failure.text);
        model_free(model);
    }
    TEST_ASSERT_INT32_WITHIN(2, parameters[1].hysteresis_offset, parameters[0].hysteresis_offset);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_stop_form_is_inverted_to_rounding);
    RUN_TEST(test_mass_and_damping_are_driven_for);
    RUN_TEST(test_the_straight_line_is_that_of_a_slow_loop);
    RUN_TEST(test_a_large_damping_is_rolled_off);
    RUN_TEST(test_the_roll_off_does_not_depend_on_the_rate);
    RUN_TEST(test_play_form_is_undone_as_a_mode_or_two_lags);
    RUN_TEST(test_preload_is_made_up_for);
    RUN_TEST(test_preload_and_creep_keep_the_middle);
    return UNITY_END();
}
