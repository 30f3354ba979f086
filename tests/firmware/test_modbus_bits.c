/* SPDX-License-Identifier: MIT */
/* Functions 1, 2, 5, 8, 15 and 22: answers, and the exceptions in the order of the standard (V1.1b3). */
#include "amplifier.h"
#include "fake_board.h"
#include "loop/capture.h"
#include "loop/loop.h"
#include "master.h"
#include "modbus/modbus_bits.h"
#include "unity.h"
#include <string.h>

#define BYTES(...) (const uint8_t[]){__VA_ARGS__}, sizeof((const uint8_t[]){__VA_ARGS__})

void setUp(void) {
    fake_board_power_on(0);
}
void tearDown(void) {
}

static void ask(const uint8_t *pdu, size_t length, const uint8_t *expected, size_t expected_length) {
    uint8_t answer[MODBUS_FRAME_MAX];
    const size_t got = master_ask(pdu, length, answer);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(expected, answer, expected_length < got ? expected_length : got);
    TEST_ASSERT_EQUAL_UINT(expected_length, got);
}

static void test_the_coil_arms_and_disarms(void) {
    ask(BYTES(1, 0, 0, 0, 1), BYTES(1, 1, 1));
    ask(BYTES(5, 0, 0, 0, 0), BYTES(5, 0, 0, 0, 0));
    (void)fake_board_run(2);
    ask(BYTES(1, 0, 0, 0, 1), BYTES(1, 1, 0));
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_OFF, master_get(INDEX_amplifier_state));
    ask(BYTES(15, 0, 0, 0, 1, 1, 1), BYTES(15, 0, 0, 0, 1));
    TEST_ASSERT_TRUE(loop_armed());
    ask(BYTES(15, 0, 0, 0, 1, 1, 0xFE), BYTES(15, 0, 0, 0, 1));
    TEST_ASSERT_FALSE_MESSAGE(loop_armed(), "bits behind the last coil mean nothing");
    ask(BYTES(5, 0, 0, 0xFF, 0), BYTES(5, 0, 0, 0xFF, 0));
    TEST_ASSERT_TRUE(loop_armed());
}

static void test_arming_by_the_coil_has_the_same_conditions(void) {
    const board_start_t start = {.reset_cause = RESET_POWER};
    fake_store_clear();
    fake_board_start(&start);
    ask(BYTES(5, 0, 0, 0xFF, 0), BYTES(0x85, 3));
    ask(BYTES(15, 0, 0, 0, 1, 1, 1), BYTES(0x8F, 3));
    TEST_ASSERT_FALSE(loop_armed());
}

static void test_discrete_inputs_are_the_bits_of_the_registers(void) {
    uint8_t answer[MODBUS_FRAME_MAX];
    const loop_input_t blind = {.faults = FAULT_CONVERTER_TIMEOUT | FAULT_SUPPLY};
    (void)loop_sample(&blind);
    const size_t length = master_ask(BYTES(2, 0, 0, 0, MODBUS_DISCRETE_INPUTS), answer);
    TEST_ASSERT_EQUAL_UINT(2U + 9U, length);
    TEST_ASSERT_EQUAL_UINT8(9, answer[1]);
    TEST_ASSERT_EQUAL_HEX32(master_get(INDEX_faults_live), (uint32_t)(answer[2] | answer[3] << 8));
    TEST_ASSERT_EQUAL_HEX32(master_get(INDEX_faults_sticky), (uint32_t)(answer[4] | answer[5] << 8));
    TEST_ASSERT_EQUAL_HEX8_MESSAGE(0x10, answer[10], "in a fault, not armed");
    for (uint8_t i = 0; i < MODBUS_DISCRETE_INPUTS; i++) { /* one at a time */
        ask(BYTES(2, 0, i, 0, 1), BYTES(2, 1, (uint8_t)(answer[2 + i / 8] >> i % 8 & 1)));
    }
}

/* Function, quantity, address, value: the first that is wrong decides. */
static void test_exceptions_in_the_order_of_the_standard(void) {
    ask(BYTES(1, 0, 0, 0, 0), BYTES(0x81, 3));
    ask(BYTES(1, 0, 9, 0, 0), BYTES(0x81, 3));
    ask(BYTES(1, 0, 0, 7, 0xD1), BYTES(0x81, 3));
    ask(BYTES(1, 0, 0, 0, 2), BYTES(0x81, 2));
    ask(BYTES(1, 0, 1, 0, 1), BYTES(0x81, 2));
    ask(BYTES(1, 0xFF, 0xFF, 0, 1), BYTES(0x81, 2));
    ask(BYTES(1, 0, 0, 0), BYTES(0x81, 3));
    ask(BYTES(2, 0, 0, 0, MODBUS_DISCRETE_INPUTS + 1), BYTES(0x82, 2));
    ask(BYTES(2, 0, 0, 7, 0xD0), BYTES(0x82, 2));
    ask(BYTES(5, 0, 0, 0, 1), BYTES(0x85, 3));
    ask(BYTES(5, 0, 1, 0, 1), BYTES(0x85, 3));
    ask(BYTES(5, 0, 1, 0xFF, 0), BYTES(0x85, 2));
    ask(BYTES(15, 0, 0, 0, 0, 1, 0), BYTES(0x8F, 3));
    ask(BYTES(15, 0, 0, 0, 1, 2, 0, 0), BYTES(0x8F, 3));
    ask(BYTES(15, 0, 0, 0, 1, 1), BYTES(0x8F, 3));
    ask(BYTES(15, 0, 0, 0, 2, 1, 0), BYTES(0x8F, 2));
    ask(BYTES(22, 0, 0, 0, 0, 0, 0), BYTES(0x96, 2));
    ask(BYTES(22, 0x30, 0, 0, 0, 0, 0), BYTES(0x96, 2));
    ask(BYTES(22, 1, 1, 0, 0, 0), BYTES(0x96, 3));
    ask(BYTES(22, 1, 1, 0, 0, 0, 77), BYTES(0x96, 3));
    ask(BYTES(8, 0, 99, 0, 0), BYTES(0x88, 1));
    ask(BYTES(8, 0, 12, 0, 1), BYTES(0x88, 3));
    ask(BYTES(8, 0), BYTES(0x88, 3));
}

/* What cannot be read now is looked at behind all addresses of the request: frames are being written. */
static void test_no_address_before_not_now(void) {
    const uint16_t frame = ADDRESS_capture;
    master_put(INDEX_capture_trigger, CAPTURE_AT_FAULT);
    master_command(COMMAND_ARM_CAPTURE);
    ask(BYTES(3, frame >> 8, 0, 0, 1), BYTES(0x83, 4));
    ask(BYTES(22, frame >> 8, 0, 0, 0, 0, 0), BYTES(0x96, 2));
    ask(BYTES(23, frame >> 8, 0, 0, 1, 0xFF, 0, 0, 1, 2, 0, 0), BYTES(0x97, 2));
    ask(BYTES(23, frame >> 8, 0, 0, 1, frame >> 8, 0, 0, 1, 2, 0, 0), BYTES(0x97, 2));
    ask(BYTES(23, frame >> 8, 0, 0, 1, 1, 1, 0, 1, 2, 0, 0), BYTES(0x97, 4));
    TEST_ASSERT_EQUAL_UINT32(WRITE_READ_ONLY, master_get(INDEX_write_refused));
    TEST_ASSERT_EQUAL_UINT32(frame, master_get(INDEX_write_refused_at));
}

/* result = (present and mask) or (or_mask and not mask) */
static void test_mask_write(void) {
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_capture_length, 0x0012));
    ask(BYTES(22, 1, 0x0F, 0, 0xF2, 0, 0x25), BYTES(22, 1, 0x0F, 0, 0xF2, 0, 0x25));
    TEST_ASSERT_EQUAL_HEX32(0x17, master_get(INDEX_capture_length)); /* the example of the standard */
    ask(BYTES(22, 1, 2, 0, 0, 0, 0), BYTES(0x96, 2));                /* half of the setpoint */
}

static void test_diagnostics(void) {
    ask(BYTES(8, 0, 0, 0xA5, 0x37), BYTES(8, 0, 0, 0xA5, 0x37));
    uint8_t longest[253] = {8}; /* any data, of whole registers */
    for (size_t i = 3; i < sizeof longest; i++) {
        longest[i] = (uint8_t)i;
    }
    ask(longest, sizeof longest, longest, sizeof longest);
    ask(longest, 7, longest, 7);
    ask(longest, 6, BYTES(0x88, 3));
    ask(longest, 3, BYTES(0x88, 3));
    ask(BYTES(8, 0, 10, 0, 0), BYTES(8, 0, 10, 0, 0));
    ask(BYTES(8, 0, 12, 0, 0), BYTES(8, 0, 12, 0, 0));
    modbus_server_receive(1); /* a frame of one byte is broken */
    fake_board.microseconds += 2 * FAKE_SILENCE_US;
    (void)amplifier_serve();
    ask(BYTES(8, 0, 12, 0, 0), BYTES(8, 0, 12, 0, 1));
    ask(BYTES(8, 0, 10, 0, 1), BYTES(0x88, 3));
    ask(BYTES(8, 0, 10, 0, 0, 0, 0), BYTES(0x88, 3));
    ask(BYTES(8, 0, 12, 0, 0), BYTES(8, 0, 12, 0, 1)); /* what was refused cleared nothing */
    ask(BYTES(8, 0, 10, 0, 0), BYTES(8, 0, 10, 0, 0));
    ask(BYTES(8, 0, 12, 0, 0), BYTES(8, 0, 12, 0, 0));
}

/* A broadcast is for writing: one that reads or diagnoses is nobody's. */
static void test_broadcast_reads_are_ignored(void) {
    static const uint8_t functions[] = {1, 2, 3, 4, 8, 23, 43};
    for (size_t i = 0; i < sizeof functions; i++) {
        uint8_t frame[MODBUS_FRAME_MAX], reply[MODBUS_FRAME_MAX];
        size_t reply_length;
        const uint8_t pdu[] = {functions[i], 0, 0, 0, 1, 1, 1, 0, 1, 2, 0, 3};
        const size_t length = master_frame(frame, MODBUS_BROADCAST_ADDRESS, pdu, functions[i] == 23 ? 12 : 5);
        TEST_ASSERT_EQUAL(MODBUS_FRAME_FOREIGN, modbus_serve(frame, length, reply, &reply_length));
        TEST_ASSERT_EQUAL_UINT(0, reply_length);
    }
    TEST_ASSERT_EQUAL_UINT32(HYST_MODE_PARK, master_get(INDEX_mode));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_the_coil_arms_and_disarms);
    RUN_TEST(test_arming_by_the_coil_has_the_same_conditions);
    RUN_TEST(test_discrete_inputs_are_the_bits_of_the_registers);
    RUN_TEST(test_exceptions_in_the_order_of_the_standard);
    RUN_TEST(test_no_address_before_not_now);
    RUN_TEST(test_mask_write);
    RUN_TEST(test_diagnostics);
    RUN_TEST(test_broadcast_reads_are_ignored);
    return UNITY_END();
}
