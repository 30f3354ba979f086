/* SPDX-License-Identifier: MIT */
/* Converters of 12 bits, as on h405: the drive is rounded to what they can hold, and capture says what they got. */
#include "fake_board.h"
#include "loop/capture.h"
#include "loop/loop.h"
#include "master.h"
#include "unity.h"

_Static_assert(FAKE_CONVERTER_BITS == 12, "this test needs a board of its own");

void setUp(void) {
    fake_board_power_on(0);
}
void tearDown(void) {
}

static void test_drive_is_rounded_to_12_bits(void) {
    static const struct {
        hyst_q31_t drive;
        uint16_t code;
    } cases[] = {{INT32_MIN, 0x0000},      {INT32_MIN + (1 << 19), 0x0010}, {-(1 << 19), 0x8000},
                 {-(1 << 19) - 1, 0x7FF0}, {(1 << 19) - 1, 0x8000},         {1 << 19, 0x8010},
                 {INT32_MAX, 0xFFF0}};
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_mode, HYST_MODE_DIRECT));
    (void)fake_board_run(1); /* the change of mode is over before the drive moves: no transition */
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_setpoint_slew, INT32_MAX));
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_setpoint, (uint32_t)cases[i].drive));
        (void)fake_board_run(10);
        TEST_ASSERT_EQUAL_HEX16(cases[i].code, fake_board_sample(0));
        TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_capture_length, 1));
        master_command(COMMAND_ARM_CAPTURE);
        (void)fake_board_run(1);
        uint16_t frame[3];
        TEST_ASSERT_EQUAL(MODBUS_OK, master_read(ADDRESS_capture, 3, frame));
        TEST_ASSERT_EQUAL_HEX16(cases[i].code ^ BOARD_CODE_MIDDLE, frame[1]);
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_drive_is_rounded_to_12_bits);
    return UNITY_END();
}
