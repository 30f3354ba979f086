/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A processor fault in the image that would be flashed: the output is parked, and nothing moves it any more. */
#include "board.h"
#include "emulated_h405.h"
#include "hyst/compensator.h"
#include "unity.h"

void setUp(void) {
}

void tearDown(void) {
}

static void test_a_fault_parks_the_output(void) {
    h405_start();
    h405_write(INDEX_mode, HYST_MODE_DIRECT);
    h405_write(INDEX_setpoint_slew, HYST_Q31_MAX);
    h405_write(INDEX_setpoint, HYST_Q31_MAX / 2);
    peripheral_log_read(&h405_log);
    h405_wait(h405_log.codes + 100);
    TEST_ASSERT_EQUAL_HEX16_MESSAGE(0xC000, h405_log.code[h405_log.codes - 1], "elsewhere than parked");

    h405_crash();

    /* Control values: on at start, triggered by the timer, and now on without a trigger: the code goes out at once. */
    const bool parked = peripheral_log_wait_for_control(&h405_log, 3, PATIENCE_S);
    TEST_ASSERT_TRUE_MESSAGE(parked, "the fault handler does not touch the converter");
    TEST_ASSERT_EQUAL_HEX32(0x01, h405_log.control[2]);
    const size_t last = h405_log.codes_at_control[2];
    TEST_ASSERT_FALSE_MESSAGE(peripheral_log_wait(&h405_log, last + 2, 1.0), "the loop goes on after the fault");
    TEST_ASSERT_EQUAL_UINT(last + 1, h405_log.codes);
    TEST_ASSERT_EQUAL_HEX16(BOARD_CODE_MIDDLE, h405_log.code[last]);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_fault_parks_the_output);
    h405_end();
    return UNITY_END();
}
