/* SPDX-License-Identifier: GPL-3.0-or-later */
/* On which side of the actuator's voltage an effect is, from an actuator that shares no formula with the blocks. */
#include "diagnosis/evidence/electrical.h"
#include "measured_actuator.h"
#include "support.h"
#include "unity.h"
#include <gsl/gsl_math.h>
#include <math.h>
#include <stdlib.h>

enum { SAMPLES = 8000, RECORDINGS = 2 };
static random_t rng;
static recording_t recordings[RECORDINGS];
static samples_t samples;
static model_t plain, with;
static failure_t failure;

void setUp(void) {
    const double weights[] = {0.1, 0.03}, thresholds[] = {15.0};
    make_bank_model(&plain, 2000.0, 0.0, 1, weights, thresholds);
}

void tearDown(void) {
    samples_close(&samples);
    model_free(&plain);
    model_free(&with);
    for (size_t i = 0; i < RECORDINGS; i++) {
        recording_free(&recordings[i]);
    }
}

static void measure(actuator_t actuator, size_t count) {
    samples_close(&samples);
    for (size_t i = 0; i < count; i++) {
        recording_free(&recordings[i]);
        actuator.samples = SAMPLES;
        measure_actuator(&actuator, "actuator.csv", &rng, &recordings[i]);
    }
    TEST_ASSERT_TRUE_MESSAGE(samples_open(&samples, &plain, recordings, count, &failure), failure.text);
}

/* The chain with a block of one number (of a rail: the upper one). */
static void suppose(const block_t *block, double number) {
    const double value[BLOCK_MAX_PARAMETERS] = {block == &block_amplifier_saturation ? -1e3 : number, number};
    model_free(&with);
    insert_block(&with, &plain, block, value);
}

static change_verdict_t verdict_of(column_t column) {
    const electrical_change_t change = electrical_change(&samples, column, &plain, &with);
    printf("%s: %.4f +- %.4f\n", column_name(column), change.part, change.sigma);
    return electrical_verdict(&change);
}

static double likelihood_of(const block_t *block) {
    return electrical_likelihood(&samples, &plain, &with, block);
}

/* Whether voltage and current confirm the block that there is, or contradict it when it is behind them. */
static void expect(const actuator_t *actuator, const block_t *block, double number, change_verdict_t verdict) {
    measure(*actuator, 1);
    suppose(block, number);
    TEST_ASSERT_EQUAL_INT(verdict, verdict_of(COLUMN_VOLTAGE));
    TEST_ASSERT_EQUAL_INT(verdict, verdict_of(COLUMN_CURRENT));
    if (verdict == CHANGE_PRESENT) {
        TEST_ASSERT_TRUE(likelihood_of(block) > 100.0);
    } else if (block == &block_transport_delay) { /* the same chain has the delay behind the voltage */
        TEST_ASSERT_EQUAL_DOUBLE(0.0, likelihood_of(block));
    } else {
        TEST_ASSERT_TRUE(likelihood_of(block) < -100.0);
    }
}

static void test_what_is_before_the_voltage_is_in_it(void) {
    expect(&(actuator_t){.amplifier_hz = 150.0, .voltage = true, .current = true}, &block_amplifier_bandwidth, 150.0,
           CHANGE_PRESENT);
    expect(&(actuator_t){.amplifier_delay_s = 1.5e-3, .voltage = true, .current = true}, &block_transport_delay, 1.5e-3,
           CHANGE_PRESENT);
    expect(&(actuator_t){.slew_v_per_s = 3000.0, .voltage = true, .current = true}, &block_amplifier_slew_limit, 3000.0,
           CHANGE_PRESENT);
    expect(&(actuator_t){.rail_v = 92.0, .voltage = true, .current = true}, &block_amplifier_saturation, 92.0,
           CHANGE_PRESENT);
}

static void test_what_is_behind_the_voltage_is_not(void) {
    expect(&(actuator_t){.sensor_hz = 150.0, .voltage = true, .current = true}, &block_amplifier_bandwidth, 150.0,
           CHANGE_ABSENT);
    expect(&(actuator_t){.sensor_delay_s = 1.5e-3, .voltage = true, .current = true}, &block_transport_delay, 1.5e-3,
           CHANGE_ABSENT);
    expect(&(actuator_t){.voltage = true, .current = true}, &block_amplifier_slew_limit, 3000.0, CHANGE_ABSENT);
    expect(&(actuator_t){.voltage = true, .current = true}, &block_amplifier_saturation, 92.0, CHANGE_ABSENT);
}

/* A monitor output of another scale and with an offset; and one with a lag of its own, a tenth of that in question.
 */
static void test_a_monitor_need_not_be_calibrated(void) {
    suppose(&block_amplifier_bandwidth, 150.0);
    measure((actuator_t){.amplifier_hz = 150.0, .monitor_gain = 0.05, .voltage = true}, 1);
    const electrical_change_t scaled = electrical_change(&samples, COLUMN_VOLTAGE, &plain, &with);
    TEST_ASSERT_TRUE(scaled.measured);
    TEST_ASSERT_DOUBLE_WITHIN(0.01, 1.0, scaled.part);
    measure((actuator_t){.sensor_hz = 150.0, .monitor_hz = 1500.0, .voltage = true}, 1);
    TEST_ASSERT_EQUAL_INT(CHANGE_ABSENT, verdict_of(COLUMN_VOLTAGE));
    measure((actuator_t){.amplifier_hz = 150.0, .monitor_hz = 1500.0, .voltage = true}, 1);
    TEST_ASSERT_EQUAL_INT(CHANGE_PRESENT, verdict_of(COLUMN_VOLTAGE));
}

/* One that lags behind the position lags on its own account. */
static void test_a_slow_monitor_decides_nothing(void) {
    measure((actuator_t){.sensor_hz = 600.0, .monitor_hz = 150.0, .voltage = true}, 1);
    suppose(&block_amplifier_bandwidth, 600.0);
    TEST_ASSERT_EQUAL_INT(CHANGE_TOO_LARGE, verdict_of(COLUMN_VOLTAGE));
    TEST_ASSERT_EQUAL_DOUBLE(0.0, likelihood_of(&block_amplifier_bandwidth));
}

/* A low pass and a delay of the same time differ where the drive is fast. */
static void test_the_voltage_tells_a_delay_from_a_low_pass(void) {
    const double seconds = 1.0 / (2.0 * M_PI * 400.0);
    measure((actuator_t){.amplifier_hz = 400.0, .voltage = true}, 1);
    suppose(&block_amplifier_bandwidth, 400.0);
    const double low_pass = likelihood_of(&block_amplifier_bandwidth);
    suppose(&block_transport_delay, seconds);
    TEST_ASSERT_TRUE(low_pass > likelihood_of(&block_transport_delay) + 100.0);
    measure((actuator_t){.amplifier_delay_s = 0.375e-3, .voltage = true}, 1);
    suppose(&block_transport_delay, 0.375e-3);
    const double delay = likelihood_of(&block_transport_delay);
    suppose(&block_amplifier_bandwidth, 400.0);
    TEST_ASSERT_TRUE(delay > likelihood_of(&block_amplifier_bandwidth) + 100.0);
}

static void test_without_a_column_nothing_is_said(void) {
    measure((actuator_t){.amplifier_hz = 150.0}, 1);
    suppose(&block_amplifier_bandwidth, 150.0);
    TEST_ASSERT_EQUAL_INT(CHANGE_NOT_SEEN, verdict_of(COLUMN_VOLTAGE));
    TEST_ASSERT_EQUAL_INT(CHANGE_NOT_SEEN, verdict_of(COLUMN_CURRENT));
    TEST_ASSERT_EQUAL_DOUBLE(0.0, likelihood_of(&block_amplifier_bandwidth));
    measure((actuator_t){.amplifier_hz = 150.0, .voltage = true}, 1);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, likelihood_of(&block_sensor_bandwidth)); /* it does not belong to the electronics */
    model_free(&with);
    model_copy(&with, &plain);
    TEST_ASSERT_EQUAL_INT(CHANGE_NOT_SEEN, verdict_of(COLUMN_VOLTAGE)); /* no difference */
}

/* A dead monitor, of which only noise is left, is no evidence against the amplifier. */
static void test_a_dead_monitor_decides_nothing(void) {
    measure((actuator_t){.amplifier_hz = 150.0, .voltage = true, .monitor_gain = 1e-9}, 1);
    suppose(&block_amplifier_bandwidth, 150.0);
    TEST_ASSERT_EQUAL_INT(CHANGE_UNDECIDED, verdict_of(COLUMN_VOLTAGE));
    TEST_ASSERT_TRUE(fabs(likelihood_of(&block_amplifier_bandwidth)) < 20.0);
    for (size_t k = 0; k < SAMPLES; k++) {
        recordings[0].column[COLUMN_VOLTAGE][k] = 0.0;
    }
    TEST_ASSERT_EQUAL_INT(CHANGE_NOT_SEEN, verdict_of(COLUMN_VOLTAGE));
    TEST_ASSERT_EQUAL_DOUBLE(0.0, likelihood_of(&block_amplifier_bandwidth));
}

/* The second recording has other offsets, or no such column. */
static void test_recordings_need_not_be_alike(void) {
    measure((actuator_t){.amplifier_hz = 150.0, .voltage = true}, RECORDINGS);
    for (size_t k = 0; k < SAMPLES; k++) {
        recordings[1].column[COLUMN_VOLTAGE][k] += 7.0;
    }
    suppose(&block_amplifier_bandwidth, 150.0);
    TEST_ASSERT_EQUAL_INT(CHANGE_PRESENT, verdict_of(COLUMN_VOLTAGE));
    free(recordings[1].column[COLUMN_VOLTAGE]);
    recordings[1].column[COLUMN_VOLTAGE] = NULL;
    TEST_ASSERT_EQUAL_INT(CHANGE_PRESENT, verdict_of(COLUMN_VOLTAGE));
    double *voltage = samples_column(&samples);
    electrical_measured_voltage(&samples, &with, voltage);
    for (size_t k = 2000; k < SAMPLES; k++) { /* 5 deviations of the monitor's noise, and its offset's error */
        TEST_ASSERT_DOUBLE_WITHIN(0.06, recordings[0].column[COLUMN_VOLTAGE][k] - 0.3, voltage[k]);
        TEST_ASSERT_DOUBLE_WITHIN(0.06, recordings[0].column[COLUMN_VOLTAGE][k] - 0.3, voltage[SAMPLES + k]);
    }
    free(voltage);
}

int main(void) {
    rng = random_start("diagnosis_electrical", 20261121);
    UNITY_BEGIN();
    RUN_TEST(test_what_is_before_the_voltage_is_in_it);
    RUN_TEST(test_what_is_behind_the_voltage_is_not);
    RUN_TEST(test_a_monitor_need_not_be_calibrated);
    RUN_TEST(test_a_slow_monitor_decides_nothing);
    RUN_TEST(test_the_voltage_tells_a_delay_from_a_low_pass);
    RUN_TEST(test_without_a_column_nothing_is_said);
    RUN_TEST(test_a_dead_monitor_decides_nothing);
    RUN_TEST(test_recordings_need_not_be_alike);
    return UNITY_END();
}
