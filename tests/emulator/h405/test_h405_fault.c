/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * A processor fault in the image that would be flashed: the output goes to the parking code of the image in force, the
 * processor starts anew, off, and says what happened.
 *
 * The emulated converter does not know what it holds, and says code 0: the ramp begins there.
 */
#include "amplifier/amplifier_image.h"
#include "board.h"
#include "emulated_h405.h"
#include "hyst/compensator.h"
#include "loop/telemetry.h"
#include "unity.h"

#define SAFE_CODE 0U
#define PARK_CODE 0x8000U /* of the default image: the middle */

void setUp(void) {
}

void tearDown(void) {
}

static int64_t value_of(int which) {
    failure_t failure;
    int64_t value = 0;
    check(device_read(h405_device, which, &value, &failure), &failure);
    return value;
}

static void hold_somewhere(void) {
    failure_t failure;
    hyst_parameters_t parameters;
    hyst_parameters_default(&parameters);
    parameters.transition_slew = HYST_Q31_MAX / 100; /* not to wait long */
    check(amplifier_image_write(h405_device, &parameters, &failure), &failure);
    h405_write(INDEX_watchdog, 0);
    h405_write(INDEX_command, COMMAND_ARM);
    h405_write(INDEX_mode, HYST_MODE_DIRECT);
    h405_write(INDEX_setpoint_slew, HYST_Q31_MAX);
    h405_write(INDEX_setpoint, HYST_Q31_MAX / 2);
    while (value_of(INDEX_amplifier_state) != AMPLIFIER_HOLD) {
    }
    peripheral_log_read(&h405_log);
    h405_wait(h405_log.codes + 100);
    TEST_ASSERT_EQUAL_HEX16_MESSAGE(0xC000, h405_log.code[h405_log.codes - 1], "elsewhere than parked");
}

static void test_a_fault_parks_the_output_and_starts_anew(void) {
    h405_start();
    TEST_ASSERT_EQUAL_INT64(1, value_of(INDEX_starts));
    hold_somewhere();

    h405_crash();

    /* Control values: on and triggered at the start; on without a trigger, so that the codes go out at once; and both
     * again at the new start. */
    const bool started = peripheral_log_wait_for_control(&h405_log, 5, PATIENCE_S);
    TEST_ASSERT_TRUE_MESSAGE(started, "the fault handler does not start the processor anew");
    TEST_ASSERT_EQUAL_HEX32(0x01, h405_log.control[2]);
    TEST_ASSERT_EQUAL_HEX32(0x01, h405_log.control[3]);
    TEST_ASSERT_EQUAL_HEX32(0x25, h405_log.control[4]);
    h405_wait(h405_log.codes_at_control[4] + 2);
    const size_t log_codes_before_ramp = h405_log.codes_at_control[2];
    const size_t first = h405_log.codes_at_control[2] - 1, start = h405_log.codes_at_control[3] - 1;
    TEST_ASSERT_EQUAL_UINT_MESSAGE(first + (PARK_CODE >> 4) + 1, start, "one code a step, and none beyond it");
    for (size_t i = first; i < start; i++) {
        TEST_ASSERT_EQUAL_HEX16_MESSAGE((i - first) << 4, h405_log.code[i], "up to the parking code of the image");
    }
    TEST_ASSERT_EQUAL_UINT_MESSAGE(log_codes_before_ramp, h405_log.codes_at_food[3],
                                   "the hardware watchdog is fed before the ramp, which has all its time then");
    for (size_t i = start; i < h405_log.codes; i++) {
        TEST_ASSERT_EQUAL_HEX16_MESSAGE(SAFE_CODE, h405_log.code[i], "the image was not stored");
    }
}

/* On the bench image, because QEMU 7.2's timer, the h405's sample clock, hardly runs any more after a reset. */
static void test_the_record_of_a_fault_survives_the_reset(void) {
    bench_start();
    TEST_ASSERT_EQUAL_INT64(1, value_of(INDEX_starts));
    TEST_ASSERT_EQUAL_INT64(0, value_of(INDEX_fault_address));
    h405_crash();
    TEST_ASSERT_EQUAL_INT64(2, value_of(INDEX_starts));
    TEST_ASSERT_EQUAL_INT64(RESET_FAULT, value_of(INDEX_reset_cause) & RESET_FAULT);
    TEST_ASSERT_EQUAL_HEX64(0x60000000, value_of(INDEX_fault_address));
    TEST_ASSERT_TRUE(value_of(INDEX_fault_status) != 0);
    TEST_ASSERT_EQUAL_INT64(AMPLIFIER_OFF, value_of(INDEX_amplifier_state));
    TEST_ASSERT_EQUAL_INT64_MESSAGE(0, value_of(INDEX_commits), "the image that was pushed is gone");
}

/* A stack that has grown into its guard: a fault of the memory protection, and no access to what is there, nor one
 * below the memory (bits 0 to 7 of the status are that unit's, 8 to 15 the bus's, the others wrong instructions). */
static void test_a_stack_that_overflows_is_a_fault(void) {
    bench_start();
    h405_overflow_stack();
    TEST_ASSERT_EQUAL_INT64(2, value_of(INDEX_starts));
    TEST_ASSERT_EQUAL_INT64(RESET_FAULT, value_of(INDEX_reset_cause) & RESET_FAULT);
    const int64_t status = value_of(INDEX_fault_status);
    TEST_ASSERT_TRUE_MESSAGE((status & 0xFF) != 0, "not the memory protection's fault");
    TEST_ASSERT_EQUAL_HEX64(0, status >> 8);
    TEST_ASSERT_EQUAL_INT64_MESSAGE(0, value_of(INDEX_fault_address), "nothing is taken from such a stack");
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_fault_parks_the_output_and_starts_anew);
    h405_end();
    RUN_TEST(test_the_record_of_a_fault_survives_the_reset);
    h405_end();
    RUN_TEST(test_a_stack_that_overflows_is_a_fault);
    h405_end();
    return UNITY_END();
}
