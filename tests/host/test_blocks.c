/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Each block against the closed solution of its own equation, written independently of the block. */
#include "support.h"
#include "unity.h"
#include <gsl/gsl_math.h>
#include <stdio.h>
#include <stdlib.h>

void setUp(void) {
}
void tearDown(void) {
}

/* A ramp of slope s from rest: the first-order hold has nothing to approximate, so rounding alone is left. */
static void test_resonance_answers_a_ramp_exactly(void) {
    const double rate = 5000.0, f = 870.0, zeta = 0.013, s = 3.0, omega = 2.0 * M_PI * f;
    const double damped = omega * sqrt(1.0 - zeta * zeta);
    chain_t *chain = open_block(&block_resonance, (const double[]){f, zeta}, rate, 1);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, chain_settle(chain, 0.0));
    for (int k = 1; k < 2000; k++) {
        const double t = k / rate, e = exp(-zeta * omega * t);
        const double d0 = 2.0 * zeta * s / omega; /* deviation from the steady ramp at t = 0, its rate is -s */
        const double d = e * (d0 * cos(damped * t) + (-s + zeta * omega * d0) / damped * sin(damped * t));
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, s * t - d0 + d, chain_step(chain, s * t));
    }
    chain_close(chain);
}

static void test_lags_answer_a_ramp_exactly(void) {
    const double rate = 10000.0, cutoff = 400.0, s = 7.0, tau = 1.0 / (2.0 * M_PI * cutoff);
    const block_t *const blocks[] = {&block_amplifier_bandwidth, &block_sensor_bandwidth};
    for (size_t i = 0; i < 2; i++) {
        chain_t *chain = open_block(blocks[i], &cutoff, rate, 1);
        chain_settle(chain, 0.0);
        for (int k = 1; k < 500; k++) {
            const double t = k / rate;
            TEST_ASSERT_DOUBLE_WITHIN(1e-13, s * (t - tau + tau * exp(-t / tau)), chain_step(chain, s * t));
        }
        chain_close(chain);
    }
}

enum { SINE_SAMPLES = 2000 };

/* What a block makes of a sine, over the second half of the samples, which are whole periods. */
static void expect_response(const block_t *block, const double *values, double hz, double rate, double gain,
                            double angle, double tolerance) {
    double x[SINE_SAMPLES], in_phase = 0.0, quadrature = 0.0;
    for (int k = 0; k < SINE_SAMPLES; k++) {
        x[k] = sin(2.0 * M_PI * hz * k / rate);
    }
    pass_block(block, values, rate, SINE_SAMPLES, x);
    for (int k = SINE_SAMPLES / 2; k < SINE_SAMPLES; k++) {
        in_phase += x[k] * sin(2.0 * M_PI * hz * k / rate) * 4.0 / SINE_SAMPLES;
        quadrature += x[k] * cos(2.0 * M_PI * hz * k / rate) * 4.0 / SINE_SAMPLES;
    }
    TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(tolerance, gain, hypot(in_phase, quadrature), block->name);
    TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(tolerance, angle, atan2(quadrature, in_phase), block->name);
}

/* A sine at the cutoff of a 400 Hz lag sampled at 10 kHz: 3 dB down and 45 degrees late. A zero-order hold would be 7
 * degrees off, lines between samples would take 0.5 % of the amplitude; they still are taken about the zeros of the
 * sine, where it is nearly straight. */
static void test_a_lag_has_its_cutoff_where_it_says(void) {
    const double cutoff = 400.0;
    expect_response(&block_amplifier_bandwidth, &cutoff, cutoff, 10000.0, sqrt(0.5), -M_PI / 4.0, 1e-4);
    expect_response(&block_sensor_bandwidth, &cutoff, cutoff, 10000.0, sqrt(0.5), -M_PI / 4.0, 1e-4);
}

/* Lags of a part of a sample: delay and low pass differ by their second order alone, 5e-4 in gain here, and that is
 * what they have. Lines would be off by 2e-3. */
static void test_short_lags_are_told_apart(void) {
    const double lag_s = 1e-4, w = 2.0 * M_PI * 50.0, cutoff = 1.0 / (2.0 * M_PI * lag_s);
    expect_response(&block_transport_delay, &lag_s, 50.0, 2000.0, 1.0, -w * lag_s, 3e-5);
    expect_response(&block_amplifier_bandwidth, &cutoff, 50.0, 2000.0, 1.0 / hypot(1.0, w * lag_s), -atan(w * lag_s),
                    3e-5);
}

/* A mode at a twelfth of the sample rate, driven below, at and above its frequency: the largest error is that of lines
 * about the zeros of the sine. Lines alone would take 2 % of the amplitude at 0.08 of the sample rate. */
static void test_a_mode_answers_sines_as_its_equation_does(void) {
    const double mode[] = {166.0, 0.04}, rate = 2000.0, hz[] = {20.0, 100.0, 160.0};
    for (size_t i = 0; i < 3; i++) {
        const double r = hz[i] / mode[0], real = 1.0 - r * r, imaginary = 2.0 * mode[1] * r;
        const double gain = 1.0 / hypot(real, imaginary);
        expect_response(&block_resonance, mode, hz[i], rate, gain, -atan2(imaginary, real), 2e-3 * gain);
    }
}

/* A play of threshold_v behind a lag of the electronics: its outputs. */
static void play_behind(const block_t *lag, const double *values, double rate, double threshold_v, size_t count,
                        double *x) {
    const recording_t recording = {.sample_rate_hz = rate, .samples = count, .column[COLUMN_DRIVE] = x};
    const double weights[] = {0.0, 1.0};
    model_t model;
    failure_t failure;
    make_bank_model(&model, rate, 0.0, 1, weights, &threshold_v);
    model_block_t *block = model_append(&model, lag);
    for (size_t p = 0; p < lag->parameters; p++) {
        block->parameter[p].value[0] = values[p];
    }
    const model_block_t last = model.block[1]; /* electronics first */
    model.block[1] = model.block[0];
    model.block[0] = last;
    TEST_ASSERT_TRUE_MESSAGE(chain_simulate(&model, &recording, 1, x, &failure), failure.text);
    model_free(&model);
}

/* Up a ramp of 1 V a sample to `top`, and down again: what the play remembers is the most that has reached it, though
 * that was between two samples. */
static void test_the_hysteresis_remembers_turns_between_samples(void) {
    const double rate = 1000.0, r = 1.5, top = 20.0, delay_s = 0.3e-3, tau = 0.4, limit = 700.0;
    const double cutoff = rate / (2.0 * M_PI * tau);
    /* A low pass of tau samples follows tau behind, and turns when the drive has come back to it, tau ln 2 later. A
     * slew limit of 0.7 V a sample has gone 14 V at the top, and meets the drive 6 / 1.7 samples later. */
    const struct {
        const block_t *block;
        double value, reached;
    } cases[] = {{&block_transport_delay, delay_s, top},
                 {&block_amplifier_bandwidth, cutoff, top - tau * log(2.0)},
                 {&block_amplifier_slew_limit, limit, 14.0 + 0.7 * 6.0 / 1.7}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        double x[27], most = 0.0;
        for (int k = 0; k < 27; k++) {
            x[k] = k <= 20 ? k : 40.0 - k;
        }
        play_behind(cases[i].block, &cases[i].value, rate, r, 27, x);
        for (int k = 0; k < 27; k++) {
            most = fmax(most, x[k]);
        }
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-9, cases[i].reached - r, most, cases[i].block->name);
    }
}

/* Without a block before it: a sine of 25 samples a period whose crest is in the middle of two of them, 0.79 % of the
 * amplitude above both. The cubic's own error there is 3/128 of the fourth difference, (2 pi / 25)^4 of the amplitude.
 * A triangle goes no further than its corner. */
static void test_the_hysteresis_remembers_crests_between_samples(void) {
    const double amplitude = 40.0, r = 1.5, step = 2.0 * M_PI / 25.0, weights[] = {0.0, 1.0};
    const double accuracy[] = {1.01 * 3.0 / 128.0 * pow(step, 4.0) * amplitude, 1e-12};
    model_t model;
    failure_t failure;
    make_bank_model(&model, 1000.0, 0.0, 1, weights, &r);
    for (size_t triangle = 0; triangle < 2; triangle++) {
        double x[50], most = 0.0, least = 0.0;
        signal_t signal[51] = {0};
        for (int k = 0; k < 50; k++) {
            x[k] = triangle == 1 ? amplitude * (1.0 - 4.0 * fabs(k % 24 / 24.0 - 0.5))
                                 : amplitude * sin(step * (k + 0.75));
            signal[1 + k].value = x[k];
        }
        signal[0].value = x[0];
        const recording_t recording = {.sample_rate_hz = 1000.0, .samples = 50, .column[COLUMN_DRIVE] = x};
        double noted[50];
        chain_note_turns(signal, 50);
        TEST_ASSERT_TRUE(chain_run(&model, &recording, 1, 0, 1, signal, &failure));
        for (int k = 0; k < 50; k++) {
            noted[k] = signal[1 + k].value;
        }
        TEST_ASSERT_TRUE_MESSAGE(chain_simulate(&model, &recording, 1, x, &failure), failure.text);
        for (int k = 0; k < 50; k++) {
            TEST_ASSERT_EQUAL_DOUBLE(x[k], noted[k]);
            most = fmax(most, x[k]);
            least = fmin(least, x[k]);
        }
        TEST_ASSERT_DOUBLE_WITHIN(accuracy[triangle], amplitude - r, most);
        TEST_ASSERT_DOUBLE_WITHIN(accuracy[triangle], -(amplitude - r), least);
    }
    model_free(&model);
}

/* A rounded step that ends in a hold, half a cosine over 8 samples, goes no further than its end. */
static void test_interpolation_does_not_swing_beyond_a_step(void) {
    const double rate = 1000.0, r = 1.5, delays[] = {0.1e-3, 0.35e-3, 0.7e-3, 1.3e-3}, end = 40.0;
    for (size_t i = 0; i < 2 * sizeof delays / sizeof delays[0]; i++) {
        const double lag_s = delays[i / 2], cutoff = 1.0 / (2.0 * M_PI * lag_s);
        const bool low_pass = i % 2 != 0;
        double x[200];
        for (int k = 0; k < 200; k++) {
            x[k] = k < 8 ? 0.5 * end * (1.0 - cos(M_PI * k / 8.0)) : end;
        }
        play_behind(low_pass ? &block_amplifier_bandwidth : &block_transport_delay, low_pass ? &cutoff : &lag_s, rate,
                    r, 200, x);
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, end - r, x[199]);
    }
}

/* The middle of such a step is an inflection, where second differences are not alike: the lag is that of the curve. */
static void test_an_inflection_is_no_line(void) {
    const double rate = 1000.0, delay_s = 0.5e-3, end = 40.0;
    double x[24];
    for (int k = 0; k < 24; k++) {
        x[k] = k < 8 ? 0.0 : k < 16 ? 0.5 * end * (1.0 - cos(M_PI * (k - 8) / 8.0)) : end;
    }
    pass_block(&block_transport_delay, &delay_s, rate, 24, x);
    /* A quarter behind the middle, and before. A cubic is off by 3/128 of the fourth difference there, (pi / 8)^4 of
     * the half cosine's own; a line by an eighth of the second one. */
    for (int k = 12; k <= 13; k++) {
        const double curve = 0.5 * end * (1.0 - cos(M_PI * (k - 8.5) / 8.0));
        const double own = fabs(0.5 * end * cos(M_PI * (k - 8.5) / 8.0));
        TEST_ASSERT_DOUBLE_WITHIN(1.2 * 3.0 / 128.0 * own * pow(M_PI / 8.0, 4.0), curve, x[k]);
    }
}

static void test_delay_is_exact_in_whole_samples(void) {
    const double rate = 1000.0;
    random_t random = {3};
    for (int whole = 0; whole < 5; whole++) {
        const double delay = whole / rate;
        double past[16] = {0};
        chain_t *chain = open_block(&block_transport_delay, &delay, rate, 1);
        chain_settle(chain, 0.0);
        for (int k = 0; k < 100; k++) {
            const double u = random_normal(&random), y = chain_step(chain, u);
            past[k % 16] = u;
            TEST_ASSERT_DOUBLE_WITHIN(1e-9, k >= whole ? past[(k - whole) % 16] : 0.0, y); /* delay * rate is rounded */
        }
        chain_close(chain);
    }
}

/* What a block that delays by quarters of a sample makes of a drive, against the drive at the delayed instant. From the
 * fourth sample behind the delay on, when nothing of the settled past is among the four that it looks at. */
static void expect_delayed(double (*drive)(double sample)) {
    const double rate = 1000.0;
    enum { COUNT = 40 };
    for (int quarters = 1; quarters < 16; quarters++) {
        const double delay = 0.25 * quarters / rate;
        double x[COUNT];
        for (int k = 0; k < COUNT; k++) {
            x[k] = drive(k);
        }
        pass_block(&block_transport_delay, &delay, rate, COUNT, x);
        for (int k = quarters / 4 + 4; k < COUNT - 1; k++) { /* the last sample does not know the next */
            TEST_ASSERT_DOUBLE_WITHIN(1e-12, drive(k - 0.25 * quarters), x[k]);
        }
    }
}

/* Its curvature doubles from one end to the other: smooth. */
static double smooth_cubic(double sample) {
    const double x = sample / 20.0;
    return 1.0 - 2.0 * x + 3.0 * x * x + 0.5 * x * x * x;
}

/* Corners on samples. */
static double polygon(double sample) {
    const double in_period = fmod(sample + 40.0, 10.0);
    return in_period < 3.0 ? 2.0 * in_period : in_period < 6.0 ? 6.0 : 6.0 - 1.5 * (in_period - 6.0);
}

static void test_delay_between_samples_follows_cubics_and_polygons(void) {
    expect_delayed(smooth_cubic);
    expect_delayed(polygon);
}

/* A step: the sum of the cells' exponentials, and over log time a straight line of slope gamma. */
static void test_creep_answers_a_step_with_its_exponentials(void) {
    const double rate = 100.0, gamma = 0.02;
    chain_t *chain = open_block(&block_creep, (const double[]){gamma, 0.1, 1000.0}, rate, 1);
    double at_1_s = 0.0, at_10_s = 0.0;
    chain_settle(chain, 0.0);
    for (int k = 0; k <= 3000; k++) {
        const double y = chain_step(chain, 1.0);
        double expected = 1.0;
        for (int j = 0; j < 9; j++) {
            expected += 0.5 * gamma * -expm1(-k / rate / (0.1 * pow(10.0, 0.5 * j)));
        }
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, expected, y);
        at_1_s = k == 100 ? y : at_1_s;
        at_10_s = k == 1000 ? y : at_10_s;
    }
    TEST_ASSERT_DOUBLE_WITHIN(0.03 * gamma, gamma, at_10_s - at_1_s); /* the ripple that creep_cells.h states */
    chain_close(chain);
}

static void test_settled_means_at_rest(void) {
    static const struct {
        const block_t *block;
        double values[BLOCK_MAX_PARAMETERS], at_rest; /* at_rest: of 42.125 */
    } cases[] = {{&block_transport_delay, {0.001}, 42.125},
                 {&block_amplifier_bandwidth, {0.001}, 42.125},
                 {&block_amplifier_slew_limit, {0.001}, 42.125},
                 {&block_amplifier_saturation, {-1.0, 41.0}, 41.0},
                 {&block_asymmetric_hysteresis, {0.1, 42.125, 8.0}, 42.125 - 0.1 * 8.0},
                 {&block_creep, {0.001, 0.05, 1000.0}, 42.125 * (1.0 + 10.0 * 0.001 / 2.0)},          /* 10 cells */
                 {&block_dielectric_loss, {0.01}, 42.125 * (1.0 + 6.5 * 0.01 * 2.0 * M_LN10 / M_PI)}, /* 13 cells */
                 {&block_charge_leakage, {0.5, 3.0}, 3.0},
                 {&block_gain_drift, {0.0}, 42.125},
                 {&block_self_heating, {0.1, 2.0, 1.0, 10.0}, 42.125},
                 {&block_resonance, {300.0, 0.05}, 42.125},
                 {&block_sensor_bandwidth, {0.001}, 42.125},
                 {&block_static_nonlinearity, {0.1, 0.05, 40.125, 4.0}, 42.125 + 4.0 * (0.1 / 4.0 + 0.05 / 8.0)},
                 {&block_thermal_drift, {0.0, 1.0}, 42.125},
                 {&block_mains_interference, {50.0, 0.0}, 42.125},
                 {&block_sensor_noise, {0.0}, 42.125},
                 {&block_quantisation, {0.001}, 42.125}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        chain_t *chain = open_block(cases[i].block, cases[i].values, 10000.0, 1);
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, cases[i].at_rest, chain_settle(chain, 42.125));
        for (int k = 0; k < 100; k++) {
            TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-9, cases[i].at_rest, chain_step(chain, 42.125), cases[i].block->name);
        }
        chain_close(chain);
    }
}

static void test_noise_has_its_size_and_repeats_with_its_seed(void) {
    enum { SAMPLES = 200000 };
    const double rms = 0.3;
    chain_t *first = open_block(&block_sensor_noise, &rms, 1000.0, 11);
    chain_t *same = open_block(&block_sensor_noise, &rms, 1000.0, 11);
    chain_t *other = open_block(&block_sensor_noise, &rms, 1000.0, 12);
    double sum = 0.0, squares = 0.0, lagged = 0.0, previous = 0.0;
    int equal = 0;
    for (int k = 0; k < SAMPLES; k++) {
        const double y = chain_step(first, 0.0);
        TEST_ASSERT_TRUE(y == chain_step(same, 0.0));
        equal += y == chain_step(other, 0.0) ? 1 : 0;
        sum += y;
        squares += y * y;
        lagged += y * previous;
        previous = y;
    }
    TEST_ASSERT_EQUAL_INT(0, equal);
    /* Five standard errors each. */
    TEST_ASSERT_DOUBLE_WITHIN(5.0 * rms / sqrt(SAMPLES), 0.0, sum / SAMPLES);
    TEST_ASSERT_DOUBLE_WITHIN(5.0 * rms * rms * sqrt(2.0 / SAMPLES), rms * rms, squares / SAMPLES);
    TEST_ASSERT_DOUBLE_WITHIN(5.0 * rms * rms / sqrt(SAMPLES), 0.0, lagged / SAMPLES);
    chain_close(first);
    chain_close(same);
    chain_close(other);
}

static void test_quantisation_rounds_to_the_nearest_step(void) {
    const double step = 0.25;
    chain_t *chain = open_block(&block_quantisation, &step, 1000.0, 1);
    TEST_ASSERT_EQUAL_DOUBLE(0.25, chain_step(chain, 0.3));
    TEST_ASSERT_EQUAL_DOUBLE(-0.25, chain_step(chain, -0.3));
    TEST_ASSERT_EQUAL_DOUBLE(0.5, chain_step(chain, 0.375));
    TEST_ASSERT_EQUAL_DOUBLE(-0.25, chain_step(chain, -0.375)); /* halves up */
    chain_close(chain);
}

/* Where the rate-dependent block stands among the hysteresis blocks does not matter, and it delays the rate by one
 * sample. */
static void test_rate_dependence_widens_the_thresholds_one_sample_later(void) {
    const double rate = 100.0, weights[] = {0.0, 1.0}, threshold = 1.0;
    for (int behind = 0; behind < 2; behind++) {
        model_t model;
        chain_t *chain;
        failure_t failure;
        model_create(&model, rate);
        for (int i = 0; i < 2; i++) {
            if (i == behind) {
                model_block_t *block = model_append(&model, &block_rate_dependent_hysteresis);
                model_set(block, "beta_s", 0.02); /* 2 samples */
                model_set(block, "limit_v", 3.0);
            } else {
                model_block_t *block = model_append(&model, &block_prandtl_ishlinskii);
                model_set_array(block, "weights", 2, weights, NULL);
                model_set_array(block, "thresholds_v", 1, &threshold, NULL);
            }
        }
        chain = chain_open(&model, rate, 1, &failure);
        TEST_ASSERT_NOT_NULL(chain);
        chain_settle(chain, 0.0);
        TEST_ASSERT_EQUAL_DOUBLE(3.0, chain_step(chain, 4.0));   /* the rate was 0: play of threshold 1 */
        TEST_ASSERT_EQUAL_DOUBLE(3.0, chain_step(chain, 5.0));   /* rate 4 a sample: 1 + min(8, 3) = 4 */
        TEST_ASSERT_EQUAL_DOUBLE(17.0, chain_step(chain, 20.0)); /* rate 1 a sample: 1 + 2 = 3 */
        chain_close(chain);
        model_free(&model);
    }
}

static void test_initial_memory_is_used_and_made_reachable(void) {
    const double weights[] = {0.0, 1.0, 10.0}, thresholds[] = {1.0, 2.0}, initial[] = {0.5, 9.0};
    model_t model;
    chain_t *chain;
    failure_t failure;
    make_bank_model(&model, 100.0, 0.0, 2, weights, thresholds);
    model_set_array(&model.block[0], "initial_memory_v", 2, initial, NULL);
    chain = chain_open(&model, 100.0, 1, &failure);
    TEST_ASSERT_NOT_NULL(chain);
    TEST_ASSERT_EQUAL_DOUBLE(0.5 + 20.0, chain_settle(chain, 0.0)); /* 9 V is out of reach of a threshold of 2 V: 2 V */
    chain_close(chain);
    model_free(&model);
}

static void test_chain_refuses_a_rate_that_is_none(void) {
    const double weights[] = {1.0};
    model_t model;
    failure_t failure;
    make_bank_model(&model, 100.0, 0.0, 0, weights, NULL);
    TEST_ASSERT_NULL(chain_open(&model, 0.0, 1, &failure));
    expect_line(&failure, "sample rate of 0 Hz");
    TEST_ASSERT_NULL(chain_open(&model, (double)NAN, 1, &failure));
    model_free(&model);
}

static void test_error_measure(void) {
    const double measured[] = {0.0, 1.0, 2.0, 4.0}, simulated[] = {0.0, 1.0, 0.0, 4.0};
    const error_measure_t error = measure_error(measured, simulated, 4);
    TEST_ASSERT_EQUAL_DOUBLE(1.0, error.rms_um);
    TEST_ASSERT_EQUAL_DOUBLE(25.0, error.nrmse_percent);
    TEST_ASSERT_EQUAL_DOUBLE(2.0, error.max_um);
    TEST_ASSERT_EQUAL_UINT64(2, error.max_sample);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_creep_answers_a_step_with_its_exponentials);
    RUN_TEST(test_resonance_answers_a_ramp_exactly);
    RUN_TEST(test_lags_answer_a_ramp_exactly);
    RUN_TEST(test_a_lag_has_its_cutoff_where_it_says);
    RUN_TEST(test_short_lags_are_told_apart);
    RUN_TEST(test_a_mode_answers_sines_as_its_equation_does);
    RUN_TEST(test_the_hysteresis_remembers_turns_between_samples);
    RUN_TEST(test_the_hysteresis_remembers_crests_between_samples);
    RUN_TEST(test_interpolation_does_not_swing_beyond_a_step);
    RUN_TEST(test_an_inflection_is_no_line);
    RUN_TEST(test_delay_is_exact_in_whole_samples);
    RUN_TEST(test_delay_between_samples_follows_cubics_and_polygons);
    RUN_TEST(test_settled_means_at_rest);
    RUN_TEST(test_noise_has_its_size_and_repeats_with_its_seed);
    RUN_TEST(test_quantisation_rounds_to_the_nearest_step);
    RUN_TEST(test_rate_dependence_widens_the_thresholds_one_sample_later);
    RUN_TEST(test_initial_memory_is_used_and_made_reachable);
    RUN_TEST(test_chain_refuses_a_rate_that_is_none);
    RUN_TEST(test_error_measure);
    return UNITY_END();
}
