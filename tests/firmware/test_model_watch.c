/* SPDX-License-Identifier: MIT */
/*
 * Whether the amplifier notices that its model is no longer true. The default image is a straight line of gain 1; the
 * "actuator" repeats the drive FAKE_LATENCY samples after it was computed, and what is added to that is the error.
 */
#include "amplifier.h"
#include "fake_board.h"
#include "loop/capture.h"
#include "loop/loop.h"
#include "master.h"
#include "protection/model_watch.h"
#include "random.h"
#include "unity.h"
#include <math.h>

static random_t rng;
static hyst_q31_t drives[FAKE_LATENCY];
static unsigned now;

void setUp(void) {
    fake_board_power_on(0);
    (void)fake_board_sample(1 << 24); /* the reading had stood still while the drive went to park: that was a warning */
    (void)amplifier_serve();
    master_command(COMMAND_CLEAR);
    now = 0;
    for (unsigned i = 0; i < FAKE_LATENCY; i++) {
        drives[i] = 0;
    }
}
void tearDown(void) {
}

static void sample(hyst_q31_t error) {
    drives[now % FAKE_LATENCY] = fake_board_drive(hyst_add(drives[now % FAKE_LATENCY], error));
    now++;
}

static void run(unsigned samples, hyst_q31_t error) {
    for (unsigned i = 0; i < samples; i++) {
        sample(error);
    }
}

/* A sine that goes on, and a limit on it. */
static void play(hyst_mode_t mode, hyst_q31_t limit, uint32_t milliseconds) {
    master_put(INDEX_mode, mode);
    run(500, 0);
    master_put(INDEX_source, SOURCE_SINE);
    master_put(INDEX_source_amplitude, 1U << 29);
    master_put(INDEX_source_increment, 1U << 24);
    master_command(COMMAND_START);
    master_put(INDEX_model_error_time, milliseconds);
    master_put(INDEX_model_error_limit, (uint32_t)limit);
}

#define ERROR (1 << 24)

static void test_nothing_is_said_while_the_model_is_true(void) {
    play(HYST_MODE_COMPENSATE, 1 << 17, 0);
    run(20000, 0);
    TEST_ASSERT_EQUAL_UINT32(0, master_get(INDEX_warnings_sticky));
    TEST_ASSERT_LESS_THAN(1 << 16, (int32_t)master_get(INDEX_model_error_rms)); /* less than a code */
    TEST_ASSERT_GREATER_THAN(10, master_get(INDEX_model_error_blocks));
}

static void test_the_shares_of_an_error(void) {
    play(HYST_MODE_COMPENSATE, 0, 0);
    run(3000, 0);
    for (unsigned i = 0; i < 4096; i++) {
        sample(3 * ERROR + (i % 2 == 0 ? ERROR : -ERROR));
    }
    TEST_ASSERT_INT32_WITHIN(1 << 17, 3 * ERROR, (int32_t)master_get(INDEX_model_error_slow));
    TEST_ASSERT_INT32_WITHIN(1 << 17, ERROR, (int32_t)master_get(INDEX_model_error_fast));
    TEST_ASSERT_INT32_WITHIN(1 << 17, (int32_t)lround(ERROR * sqrt(10.0)), (int32_t)master_get(INDEX_model_error_rms));
    TEST_ASSERT_INT32_WITHIN(1 << 17, 4 * ERROR, (int32_t)master_get(INDEX_model_error_largest));
    run(4096, -ERROR);
    TEST_ASSERT_INT32_WITHIN(1 << 17, -ERROR, (int32_t)master_get(INDEX_model_error_slow));
    TEST_ASSERT_INT32_WITHIN(1 << 17, 4 * ERROR, (int32_t)master_get(INDEX_model_error_largest));
    master_command(COMMAND_CLEAR);
    run(10, -ERROR);
    TEST_ASSERT_INT32_WITHIN(1 << 17, ERROR, (int32_t)master_get(INDEX_model_error_largest));
    TEST_ASSERT_EQUAL_UINT32(0, master_get(INDEX_warnings_sticky)); /* there is no limit */
}

/* The largest errors that there can be neither overflow nor wrap. */
static void test_the_ends_of_the_range(void) {
    for (int i = 0; i < 4096; i++) {
        (void)model_watch_sample(HYST_Q31_MIN, HYST_Q31_MAX);
    }
    model_error_t error = model_watch_error();
    TEST_ASSERT_EQUAL_INT32(HYST_Q31_MAX, error.rms);
    TEST_ASSERT_EQUAL_INT32(HYST_Q31_MAX, error.slow);
    for (int i = 0; i < 4096; i++) {
        (void)model_watch_sample(HYST_Q31_MAX, HYST_Q31_MIN);
    }
    error = model_watch_error();
    TEST_ASSERT_EQUAL_INT32(HYST_Q31_MIN, error.slow);
    TEST_ASSERT_LESS_THAN(1 << 12, error.fast);
}

static void test_it_warns_after_the_stated_time_and_stops_nothing(void) {
    enum { MILLISECONDS = 300, BLOCKS = 3 };
    play(HYST_MODE_COMPENSATE, ERROR / 2, MILLISECONDS);
    run(5000, 0);
    unsigned waited = 0;
    for (; master_get(INDEX_warnings_live) == 0 && waited < 10000; waited++) {
        sample(ERROR);
    }
    /* Whole blocks that begin anywhere, and a block that is half bad may count already. */
    TEST_ASSERT_INT_WITHIN(MODEL_WATCH_BLOCK / 2 + 2, BLOCKS * MODEL_WATCH_BLOCK + MODEL_WATCH_BLOCK / 2, waited);
    TEST_ASSERT_EQUAL_UINT32(WARNING_MODEL, master_get(INDEX_warnings_live));
    TEST_ASSERT_EQUAL_UINT32(0, master_get(INDEX_faults_sticky));
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_RUN, master_get(INDEX_amplifier_state));
    run(3000, 0);
    TEST_ASSERT_EQUAL_UINT32(0, master_get(INDEX_warnings_live));
    TEST_ASSERT_EQUAL_UINT32(WARNING_MODEL, master_get(INDEX_warnings_sticky));
    master_command(COMMAND_CLEAR);
    TEST_ASSERT_EQUAL_UINT32(0, master_get(INDEX_warnings_sticky));
}

static void test_a_short_error_is_none(void) {
    play(HYST_MODE_COMPENSATE, ERROR / 2, 300);
    for (int i = 0; i < 10; i++) {
        run(5000, 0);
        run((unsigned)random_between(&rng, 1, 2 * (int32_t)MODEL_WATCH_BLOCK), ERROR);
    }
    TEST_ASSERT_EQUAL_UINT32(0, master_get(INDEX_warnings_sticky));
}

/* Without compensation the reference predicts nothing, and neither does it where the drive met a limit. */
static void test_what_is_not_the_models_is_not_watched(void) {
    play(HYST_MODE_LINEAR, ERROR / 2, 0);
    const uint32_t before = master_get(INDEX_model_error_blocks);
    run(10000, ERROR);
    TEST_ASSERT_EQUAL_UINT32(before, master_get(INDEX_model_error_blocks));
    TEST_ASSERT_EQUAL_UINT32(0, master_get(INDEX_warnings_sticky));
    master_put(INDEX_source_amplitude, 0x7FFFFFFF);
    master_put(INDEX_source_increment, 1U << 30); /* a step of half the range in every sample */
    master_put(INDEX_reference_slew, 0x7FFFFFFF); /* and the drive has to do it */
    master_put(INDEX_mode, HYST_MODE_COMPENSATE);
    master_command(COMMAND_START);
    run(100, 0);
    const uint32_t limited = master_get(INDEX_model_error_blocks);
    run(10000, ERROR);
    TEST_ASSERT_NOT_EQUAL(0, master_get(INDEX_limits_sticky));
    TEST_ASSERT_EQUAL_UINT32(limited, master_get(INDEX_model_error_blocks));
}

/* The recorder stops with what was before the warning. */
static void test_the_warning_freezes_the_recorder(void) {
    enum { LENGTH = 10000, BEFORE = 9000 };
    play(HYST_MODE_COMPENSATE, ERROR / 2, 100);
    master_put(INDEX_capture_signals, CAPTURE_REFERENCE | CAPTURE_POSITION | CAPTURE_ERROR);
    master_put(INDEX_capture_length, LENGTH);
    master_put(INDEX_capture_before, BEFORE);
    master_put(INDEX_capture_trigger, CAPTURE_AT_WARNING);
    master_command(COMMAND_ARM_CAPTURE);
    run(30000, 0);
    TEST_ASSERT_EQUAL_UINT32(CAPTURE_ARMED, master_get(INDEX_capture_state));
    unsigned bad = 0;
    for (; master_get(INDEX_capture_state) != CAPTURE_DONE && bad < 10000; bad++) {
        sample(ERROR);
    }
    TEST_ASSERT_EQUAL_UINT32(LENGTH, master_get(INDEX_capture_frames));
    run(5000, 0); /* overwrites nothing */
    for (unsigned frame = 0; frame < LENGTH; frame++) {
        uint16_t value;
        const unsigned place = (master_get(INDEX_capture_first) + frame) % CAPTURE_CAPACITY;
        TEST_ASSERT_EQUAL(MODBUS_OK, master_read((uint16_t)(ADDRESS_capture + 3 * place + 2), 1, &value));
        TEST_ASSERT_INT_WITHIN(1, frame < LENGTH - bad ? 0 : ERROR >> 16, (int16_t)value);
    }
}

static void test_a_limit_may_not_be_negative(void) {
    TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_VALUE, master_set(INDEX_model_error_limit, 0x80000000U));
}

int main(void) {
    rng = random_start("firmware_model_watch", 20261123);
    UNITY_BEGIN();
    RUN_TEST(test_nothing_is_said_while_the_model_is_true);
    RUN_TEST(test_the_shares_of_an_error);
    RUN_TEST(test_the_ends_of_the_range);
    RUN_TEST(test_it_warns_after_the_stated_time_and_stops_nothing);
    RUN_TEST(test_a_short_error_is_none);
    RUN_TEST(test_what_is_not_the_models_is_not_watched);
    RUN_TEST(test_the_warning_freezes_the_recorder);
    RUN_TEST(test_a_limit_may_not_be_negative);
    return UNITY_END();
}
