/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A drive that a converter holds: what lags, modes and delays make of it, against equations integrated here in small
 * steps, whenever the position is read. */
#include "chain/align.h"
#include "chain/chain.h"
#include "support.h"
#include "unity.h"
#include <gsl/gsl_math.h>
#include <stdlib.h>
#include <string.h>

enum { SAMPLES = 300, SUBSTEPS = 400 };

static const double rate_hz = 2000.0, weight[1] = {1.0};
static recording_t recording;
static model_t model;
static failure_t failure;

void setUp(void) {
    recording_create(&recording, "held", rate_hz, SAMPLES);
    double *drive = recording.column[COLUMN_DRIVE];
    for (size_t k = 0; k < SAMPLES; k++) { /* nothing smooth: jumps, and a tone of nine samples */
        drive[k] = k < 10 ? 0.0 : 20.0 * sin(0.7 * (double)k) + (k / 37 % 2 == 0 ? 15.0 : -15.0);
    }
    recording.held = true;
}

void tearDown(void) {
    model_free(&model);
    recording_free(&recording);
}

/* y'' + 2 zeta omega y' + omega^2 (y - u) = 0, or y' = omega (u - y); rad per sample. Or y' = +- limit until y = u. */
typedef struct {
    bool second;
    double omega, zeta, limit;
} law_t;

static void slope(const law_t *law, const double y[2], double u, double dy[2]) {
    dy[0] = law->second ? y[1] : law->omega * (u - y[0]);
    dy[1] = law->second ? law->omega * (law->omega * (u - y[0]) - 2.0 * law->zeta * y[1]) : 0.0;
}

/* Runge and Kutta's fourth order, at one value of u. */
static void run(const law_t *law, double y[2], double u, double samples) {
    const double h = samples / SUBSTEPS;
    for (int i = 0; law->limit > 0.0 && i < SUBSTEPS; i++) {
        y[0] = u > y[0] ? fmin(u, y[0] + h * law->limit) : fmax(u, y[0] - h * law->limit);
    }
    for (int i = 0; law->omega > 0.0 && i < SUBSTEPS; i++) {
        double a[2], b[2], c[2], d[2], at[2];
        slope(law, y, u, a);
        at[0] = y[0] + 0.5 * h * a[0], at[1] = y[1] + 0.5 * h * a[1];
        slope(law, at, u, b);
        at[0] = y[0] + 0.5 * h * b[0], at[1] = y[1] + 0.5 * h * b[1];
        slope(law, at, u, c);
        at[0] = y[0] + h * c[0], at[1] = y[1] + h * c[1];
        slope(law, at, u, d);
        for (int s = 0; s < 2; s++) {
            y[s] += h / 6.0 * (a[s] + 2.0 * b[s] + 2.0 * c[s] + d[s]);
        }
    }
}

/* Worst difference of the model's position to the law's, read so many parts of a sample after the drive went out, which
 * reaches the law `delay` samples later. */
static double worst(const law_t *law, double since, double delay) {
    double position[SAMPLES], y[2] = {recording.column[COLUMN_DRIVE][0], 0.0}, most = 0.0;
    const double *drive = recording.column[COLUMN_DRIVE];
    recording.held_since = since;
    TEST_ASSERT_TRUE_MESSAGE(chain_simulate(&model, &recording, 0, position, &failure), failure.text);
    for (size_t k = 1; k < SAMPLES; k++) {
        /* From the reading before to this one, the law's input changes once: at this part of the way. */
        const double read = (double)k + since - delay;
        const double newest = floor(read), late = 1.0 - (read - newest);
        const double before = newest >= 1.0 ? drive[(size_t)newest - 1] : drive[0];
        run(law, y, before, late);
        if (late < 1.0) { /* there is something newer, which behind the last sample there is not */
            run(law, y, newest >= 0.0 ? drive[(size_t)newest] : drive[0], 1.0 - late);
        }
        most = fmax(most, fabs(position[k] - y[0]));
    }
    return most;
}

/* 1e-9 of a stroke of 70: sums of some hundred terms in double precision, and Runge and Kutta's (omega / 400)^4 a
 * sample. */
static const double tolerance = 7e-8;

static void one_block(const block_t *block, const double *value) {
    model_t bank;
    make_bank_model(&bank, rate_hz, 0.0, 0, weight, NULL);
    insert_block(&model, &bank, block, value);
    model_free(&bank);
}

static void test_a_low_pass(void) {
    static const double since[] = {0.0, 0.37, 1.0};
    one_block(&block_sensor_bandwidth, (double[]){300.0});
    const law_t law = {.omega = 2.0 * M_PI * 300.0 / rate_hz};
    for (size_t i = 0; i < sizeof since / sizeof since[0]; i++) {
        TEST_ASSERT_TRUE(worst(&law, since[i], 0.0) < tolerance);
    }
    recording.held = false; /* the test can fail */
    TEST_ASSERT_TRUE(worst(&law, 1.0, 0.0) > 1.0);
}

static void test_a_mode(void) {
    static const double since[] = {0.0, 0.37, 1.0};
    one_block(&block_resonance, (double[]){300.0, 0.03});
    const law_t law = {.second = true, .omega = 2.0 * M_PI * 300.0 / rate_hz, .zeta = 0.03};
    for (size_t i = 0; i < sizeof since / sizeof since[0]; i++) {
        TEST_ASSERT_TRUE(worst(&law, since[i], 0.0) < tolerance);
    }
    recording.held = false;
    TEST_ASSERT_TRUE(worst(&law, 1.0, 0.0) > 1.0);
}

static void test_a_largest_rate(void) {
    static const double since[] = {0.0, 0.37, 1.0}, limit[] = {3.0, 11.0};
    for (size_t l = 0; l < sizeof limit / sizeof limit[0]; l++) {
        one_block(&block_amplifier_slew_limit, (double[]){limit[l] * rate_hz});
        const law_t law = {.limit = limit[l]};
        for (size_t i = 0; i < sizeof since / sizeof since[0]; i++) {
            recording.held = true;
            TEST_ASSERT_TRUE(worst(&law, since[i], 0.0) < tolerance);
        }
        recording.held = false;
        TEST_ASSERT_TRUE(worst(&law, 0.0, 0.0) > 1.0); /* a ramp from sample to sample is ahead by nearly a sample */
        model_free(&model);
    }
    model = (model_t){0};
}

static void test_a_delay_before_a_mode_is_a_part_of_a_sample_there(void) {
    static const double since[] = {0.0, 0.37, 1.0}, delay[] = {0.2, 0.37, 1.0, 2.6};
    const law_t law = {.second = true, .omega = 2.0 * M_PI * 300.0 / rate_hz, .zeta = 0.03};
    for (size_t d = 0; d < sizeof delay / sizeof delay[0]; d++) {
        model_t with_mode;
        one_block(&block_resonance, (double[]){300.0, 0.03});
        with_mode = model;
        insert_block(&model, &with_mode, &block_transport_delay, (double[]){delay[d] / rate_hz});
        model_free(&with_mode);
        for (size_t i = 0; i < sizeof since / sizeof since[0]; i++) {
            TEST_ASSERT_TRUE(worst(&law, since[i], delay[d]) < tolerance);
        }
        model_free(&model);
    }
    model = (model_t){0};
}

/* Every fifth row of a held drive of lines, whose corners are rows: in five steps a row it is the same drive, and the
 * model has to be where that of all rows is. On lines there is nothing of a curve: exact but for rounding. */
static void test_steps_between_rows(void) {
    enum { STEPS = 5, ROWS = SAMPLES / STEPS };
    static const block_t *const lag[] = {&block_sensor_bandwidth, &block_resonance};
    static const double value[][2] = {{300.0}, {300.0, 0.03}};
    for (size_t i = 0; i < sizeof lag / sizeof lag[0]; i++) {
        double all[SAMPLES], some[ROWS], most = 0.0, moved = 0.0;
        recording_t rows;
        recording_create(&rows, "rows", rate_hz / STEPS, ROWS);
        for (size_t k = 0; k < SAMPLES; k++) {
            const double turns = (double)k / 40.0;
            recording.column[COLUMN_DRIVE][k] = 80.0 * fabs(turns - floor(turns + 0.5));
            rows.column[COLUMN_DRIVE][k / STEPS] =
                k % STEPS == 0 ? recording.column[COLUMN_DRIVE][k] : rows.column[COLUMN_DRIVE][k / STEPS];
        }
        one_block(lag[i], value[i]);
        recording.held = true;
        recording.held_since = 1.0;
        TEST_ASSERT_TRUE_MESSAGE(chain_simulate(&model, &recording, 0, all, &failure), failure.text);
        model.sample_rate_hz = rate_hz / STEPS;
        recording_set_key(&rows, "drive_step_s", "0.0005");
        TEST_ASSERT_TRUE_MESSAGE(recording_align(&rows, &failure), failure.text);
        TEST_ASSERT_TRUE_MESSAGE(chain_simulate(&model, &rows, 0, some, &failure), failure.text);
        for (size_t k = 0; k < ROWS; k++) {
            most = fmax(most, fabs(some[k] - all[STEPS * k]));
        }
        TEST_ASSERT_TRUE(most < tolerance);
        rows.steps = 0; /* the test can fail */
        TEST_ASSERT_TRUE(chain_simulate(&model, &rows, 0, some, &failure));
        for (size_t k = 0; k < ROWS; k++) {
            moved = fmax(moved, fabs(some[k] - all[STEPS * k]));
        }
        TEST_ASSERT_TRUE(moved > 0.1);
        recording_free(&rows);
        model_free(&model);
    }
    model = (model_t){0};
}

static void test_bad_steps(void) {
    static const char *const bad[] = {"", "x", "0", "-0.0005", "0.0005 s", "0.0008", "0.0002", "nan", "1e-12"};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        recording_set_key(&recording, "drive_step_s", bad[i]); /* rows of 0.0005 s */
        TEST_ASSERT_FALSE_MESSAGE(recording_align(&recording, &failure), bad[i]);
        TEST_ASSERT_NOT_NULL(strstr(failure.text, "drive_step_s"));
    }
    recording_set_key(&recording, "drive_step_s", "0.0001");
    TEST_ASSERT_TRUE_MESSAGE(recording_align(&recording, &failure), failure.text);
    TEST_ASSERT_EQUAL_UINT64(5, recording.steps);
}

/* Behind the first lag the signal is no longer held: the second one takes a curve through what the first puts out. */
static void test_what_comes_out_of_a_lag_is_smooth(void) {
    double position[SAMPLES], first[SAMPLES];
    recording_t between;
    model_t lag, mode;
    one_block(&block_sensor_bandwidth, (double[]){100.0});
    lag = model;
    one_block(&block_resonance, (double[]){60.0, 0.1});
    mode = model;
    insert_block(&model, &mode, &block_amplifier_bandwidth, (double[]){100.0});
    recording.held_since = 1.0;
    TEST_ASSERT_TRUE(chain_simulate(&model, &recording, 0, position, &failure));
    TEST_ASSERT_TRUE(chain_simulate(&lag, &recording, 0, first, &failure));
    recording_copy(&between, &recording, 0, recording.samples);
    between.held = false;
    for (size_t k = 0; k < SAMPLES; k++) {
        between.column[COLUMN_DRIVE][k] = first[k];
    }
    TEST_ASSERT_TRUE(chain_simulate(&mode, &between, 0, first, &failure));
    for (size_t k = 0; k < SAMPLES; k++) {
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, first[k], position[k]);
    }
    recording_free(&between);
    model_free(&lag);
    model_free(&mode);
}

static void test_the_header_says_it(void) {
    static const struct {
        const char *after;
        double since;
        size_t dropped, newer;
    } cases[] = {{NULL, 0.0, 0, 0}, {"0.000185", 0.37, 0, 0}, {"0.0005", 1.0, 0, 0}, {"0.0012", 0.4, 2, 2}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        recording_t read;
        recording_copy(&read, &recording, 0, recording.samples);
        read.held = false;
        recording_set_key(&read, "drive_between_samples", "held");
        if (cases[i].after != NULL) {
            recording_set_key(&read, "displacement_sampled_after_s", cases[i].after);
        }
        for (int again = 0; again < 2; again++) { /* a second call changes nothing */
            TEST_ASSERT_TRUE_MESSAGE(recording_align(&read, &failure), failure.text);
            TEST_ASSERT_TRUE(read.held);
            TEST_ASSERT_DOUBLE_WITHIN(1e-9, cases[i].since, read.held_since);
            TEST_ASSERT_EQUAL_UINT(SAMPLES - cases[i].dropped, read.samples);
            TEST_ASSERT_EQUAL_DOUBLE(recording.column[COLUMN_DRIVE][20 + cases[i].newer],
                                     read.column[COLUMN_DRIVE][20]);
        }
        recording_free(&read);
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_low_pass);
    RUN_TEST(test_a_mode);
    RUN_TEST(test_a_largest_rate);
    RUN_TEST(test_a_delay_before_a_mode_is_a_part_of_a_sample_there);
    RUN_TEST(test_steps_between_rows);
    RUN_TEST(test_bad_steps);
    RUN_TEST(test_what_comes_out_of_a_lag_is_smooth);
    RUN_TEST(test_the_header_says_it);
    return UNITY_END();
}
