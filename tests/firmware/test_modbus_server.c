/* SPDX-License-Identifier: MIT */
/* The Modbus server: every function and every exception, framing by silence, and what the line can do to frames. */
#include "amplifier.h"
#include "fake_board.h"
#include "loop/capture.h"
#include "master.h"
#include "unity.h"
#include <string.h>

void setUp(void) {
    fake_board_power_on(0);
}
void tearDown(void) {
}

static void ask(const uint8_t *pdu, size_t length, const uint8_t *expected, size_t expected_length) {
    uint8_t answer[MODBUS_FRAME_MAX];
    const size_t answer_length = master_ask(pdu, length, answer);
    TEST_ASSERT_EQUAL_UINT(expected_length, answer_length);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(expected, answer, expected_length);
}

#define BYTES(...) (const uint8_t[]){__VA_ARGS__}, sizeof((const uint8_t[]){__VA_ARGS__})

/* The example of the serial line guide V1.02, appendix B: the bytes 02 07 have the CRC 0x1241, low byte first. */
static void test_crc_of_the_standards_example(void) {
    TEST_ASSERT_EQUAL_HEX16(0x1241, modbus_crc(BYTES(0x02, 0x07)));
}

static void test_functions_3_and_4_read_one_map(void) {
    ask(BYTES(3, 0, 0, 0, 1), BYTES(3, 2, 0x48, 0x59));
    ask(BYTES(4, 0, 0, 0, 1), BYTES(4, 2, 0x48, 0x59));
    ask(BYTES(4, 0, 4, 0, 2), BYTES(4, 4, 0x00, 0x98, 0x96, 0x80)); /* 10,000,000 mHz, high word first */
}

static void test_function_6_writes_one_register(void) {
    ask(BYTES(6, 0x01, 0x01, 0, 2), BYTES(6, 0x01, 0x01, 0, 2));
    TEST_ASSERT_EQUAL_UINT32(2, master_get(INDEX_mode));
}

static void test_function_16_writes_registers(void) {
    ask(BYTES(16, 0x01, 0x02, 0, 2, 4, 0x12, 0x34, 0x56, 0x78), BYTES(16, 0x01, 0x02, 0, 2));
    TEST_ASSERT_EQUAL_HEX32(0x12345678, master_get(INDEX_setpoint));
}

static void test_function_23_writes_before_it_reads(void) {
    ask(BYTES(23, 0x01, 0x02, 0, 2, 0x01, 0x02, 0, 2, 4, 0x0A, 0x0B, 0x0C, 0x0D), BYTES(23, 4, 0x0A, 0x0B, 0x0C, 0x0D));
}

/* What it reads is what there is after its write: a capture that it arms is none to be read, one that it ends is. */
static void test_function_23_reads_a_capture_as_its_write_leaves_it(void) {
    static const uint16_t longer = CAPTURE_WORDS / 3 + 1;
    const uint8_t arms[] = {23, 0x40, 0, 0, 1, 0x01, 0, 0, 1, 2, 0, COMMAND_ARM_CAPTURE};
    const uint8_t ends[] = {23, 0x40, 0, 0, 1, 0x01, 0, 0, 1, 2, 0, COMMAND_END_CAPTURE};
    const uint8_t latches[] = {23, 0x40, 0, 0, 1, 0x01, 0, 0, 1, 2, 0, COMMAND_LATCH};
    const uint8_t others[] = {23, 0x40, 0, 0, 1, 0x10, 0, 0, 2, 4, 0, 1, 0, 2};
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_capture_length, 100));
    ask(latches, sizeof latches, BYTES(23, 2, 0, 0));
    ask(arms, sizeof arms, BYTES(0x97, 4));
    TEST_ASSERT_EQUAL_MESSAGE(CAPTURE_IDLE, capture_state(), "what is refused has changed nothing");
    master_command(COMMAND_ARM_CAPTURE);
    (void)fake_board_run(10);
    ask(latches, sizeof latches, BYTES(0x97, 4));
    ask(others, sizeof others, BYTES(0x97, 4));
    ask(BYTES(23, 0x40, 0, 0, 1, 0x01, 0, 0, 1, 2, 0, 99), BYTES(0x97, 3));
    ask(BYTES(23, 0x40, 0, 0, 1, 0, 0, 0, 1, 2, 0, 1), BYTES(0x97, 2));
    ask(ends, sizeof ends, BYTES(23, 2, 0, 0));
    TEST_ASSERT_EQUAL(CAPTURE_DONE, capture_state());
    ask(others, sizeof others, BYTES(23, 2, 0, 0));
    /* One that goes round in the buffer is read while it runs. */
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_capture_length, longer));
    ask(arms, sizeof arms, BYTES(23, 2, 0, 0));
    TEST_ASSERT_EQUAL(CAPTURE_ARMED, capture_state());
    ask(latches, sizeof latches, BYTES(23, 2, 0, 0));
}

static void test_function_23_refused_in_one_half_does_nothing(void) {
    /* bad read: the write must not happen */
    ask(BYTES(23, 0x03, 0xF0, 0, 1, 0x01, 0x01, 0, 1, 2, 0, 3), BYTES(0x97, 2));
    TEST_ASSERT_EQUAL_UINT32(0, master_get(INDEX_mode));
    ask(BYTES(23, 0x01, 0x01, 0, 1, 0x01, 0x01, 0, 1, 2, 0, 9), BYTES(0x97, 3));
    ask(BYTES(23, 0x01, 0x01, 0, 126, 0x01, 0x01, 0, 1, 2, 0, 1), BYTES(0x97, 3));
    ask(BYTES(23, 0x01, 0x01, 0, 1, 0x01, 0x01, 0, 1, 4, 0, 1), BYTES(0x97, 3));
    ask(BYTES(23, 0x01, 0x01, 0, 1, 0x01, 0x01, 0, 122, 244, 0, 1), BYTES(0x97, 3));
    ask(BYTES(23, 0x01, 0x01, 0, 1), BYTES(0x97, 3));
    TEST_ASSERT_EQUAL_UINT32(0, master_get(INDEX_mode));
}

static void test_identification_stream_and_individual(void) {
    uint8_t answer[MODBUS_FRAME_MAX];
    size_t length = master_ask(BYTES(43, 14, 1, 0), answer);
    static const uint8_t header[] = {43, 14, 1, 0x83, 0, 0, 3};
    TEST_ASSERT_EQUAL_HEX8_ARRAY(header, answer, sizeof header);
    const char *expected[] = {"hyst", "piezo amplifier"};
    size_t at = 7;
    for (uint8_t object = 0; object < 3; object++) {
        TEST_ASSERT_EQUAL_UINT8(object, answer[at]);
        if (object < 2) {
            TEST_ASSERT_EQUAL_UINT8(strlen(expected[object]), answer[at + 1]);
            TEST_ASSERT_EQUAL_MEMORY(expected[object], answer + at + 2, strlen(expected[object]));
        }
        at += 2U + answer[at + 1];
    }
    TEST_ASSERT_EQUAL_UINT(length, at);
    ask(BYTES(43, 14, 4, 0), BYTES(43, 14, 4, 0x83, 0, 0, 1, 0, 4, 'h', 'y', 's', 't'));
    ask(BYTES(43, 14, 4, 3), BYTES(0xAB, 2));
    ask(BYTES(43, 14, 0, 0), BYTES(0xAB, 3));
    ask(BYTES(43, 14, 5, 0), BYTES(0xAB, 3));
    ask(BYTES(43, 14, 1), BYTES(0xAB, 3));
    ask(BYTES(43, 13, 1, 0), BYTES(0xAB, 1));
    ask(BYTES(43), BYTES(0xAB, 1));
    /* A stream that starts behind the last object restarts at the first; one in the middle gives the rest. */
    TEST_ASSERT_EQUAL_UINT(length, master_ask(BYTES(43, 14, 1, 200), answer));
    (void)master_ask(BYTES(43, 14, 1, 2), answer);
    TEST_ASSERT_EQUAL_UINT8(1, answer[6]);
    TEST_ASSERT_EQUAL_UINT8(2, answer[7]);
}

static void test_unknown_functions(void) {
    for (unsigned function = 0; function < 128; function++) {
        if (function != 3 && function != 4 && function != 6 && function != 16 && function != 23 && function != 43 &&
            function != 1 && function != 2 && function != 5 && function != 8 && function != 15 && function != 22) {
            ask(BYTES((uint8_t)function, 0, 0, 0, 1), BYTES((uint8_t)(function | 0x80U), 1));
        }
    }
}

static void test_counts_out_of_range(void) {
    ask(BYTES(3, 0, 0, 0, 0), BYTES(0x83, 3));
    ask(BYTES(3, 0x40, 0, 0, 126), BYTES(0x83, 3));
    ask(BYTES(3, 0x40, 0, 0xFF, 0xFF), BYTES(0x83, 3));
    ask(BYTES(3, 0, 0, 1), BYTES(0x83, 3));
    ask(BYTES(3, 0, 0, 0, 1, 0), BYTES(0x83, 3));
    ask(BYTES(6, 1, 1, 0), BYTES(0x86, 3));
    ask(BYTES(16, 1, 1, 0, 0, 0), BYTES(0x90, 3));
    ask(BYTES(16, 1, 1), BYTES(0x90, 3));
    uint16_t values[MODBUS_READ_MAX];
    TEST_ASSERT_EQUAL(MODBUS_OK, master_read(ADDRESS_capture, MODBUS_READ_MAX, values));
}

static void test_byte_count_that_disagrees_is_exception_3(void) {
    for (unsigned bytes = 0; bytes < 256; bytes++) {
        if (bytes == 4) {
            continue;
        }
        ask(BYTES(16, 0x01, 0x02, 0, 2, (uint8_t)bytes, 1, 2, 3, 4), BYTES(0x90, 3));
    }
    ask(BYTES(16, 0x01, 0x02, 0, 2, 4, 1, 2, 3), BYTES(0x90, 3));
    ask(BYTES(16, 0x01, 0x02, 0, 2, 4, 1, 2, 3, 4, 5), BYTES(0x90, 3));
    /* Popular servers have run past their buffers here: 255 bytes promised, as many as fit sent. */
    uint8_t pdu[253] = {16, 0x10, 0x00, 0, 127, 255};
    uint8_t answer[MODBUS_FRAME_MAX];
    TEST_ASSERT_EQUAL_UINT(2, master_ask(pdu, sizeof pdu, answer));
    TEST_ASSERT_EQUAL_HEX8(0x90, answer[0]);
    TEST_ASSERT_EQUAL_HEX8(MODBUS_ILLEGAL_VALUE, answer[1]);
    TEST_ASSERT_EQUAL_UINT32(0, master_get(INDEX_setpoint));
}

static void test_the_longest_requests(void) {
    uint16_t values[MODBUS_WRITE_MAX];
    uint16_t back[MODBUS_WRITE_MAX];
    for (unsigned i = 0; i < MODBUS_WRITE_MAX; i++) {
        values[i] = (uint16_t)(i * 523U);
    }
    TEST_ASSERT_EQUAL(MODBUS_OK, master_write(ADDRESS_staging + 7, MODBUS_WRITE_MAX, values));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_read(ADDRESS_staging + 7, MODBUS_WRITE_MAX, back));
    TEST_ASSERT_EQUAL_HEX16_ARRAY(values, back, MODBUS_WRITE_MAX);
}

static void test_addresses_do_not_wrap(void) {
    ask(BYTES(3, 0xFF, 0xFF, 0, 125), BYTES(0x83, 2));
    ask(BYTES(16, 0xFF, 0xFF, 0, 2, 4, 0, 0, 0, 0), BYTES(0x90, 2));
}

static void test_broadcast_is_executed_and_not_answered(void) {
    uint8_t frame[MODBUS_FRAME_MAX];
    uint8_t reply[MODBUS_FRAME_MAX];
    size_t reply_length = 99;
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_mode, 2));
    size_t length = master_frame(frame, MODBUS_BROADCAST_ADDRESS, BYTES(6, 0x01, 0x01, 0, 0));
    TEST_ASSERT_EQUAL(MODBUS_FRAME_BROADCAST, modbus_serve(frame, length, reply, &reply_length));
    TEST_ASSERT_EQUAL_UINT(0, reply_length);
    TEST_ASSERT_EQUAL_UINT32(0, master_get(INDEX_mode));
    length = master_frame(frame, MODBUS_BROADCAST_ADDRESS, BYTES(99, 1));
    TEST_ASSERT_EQUAL(MODBUS_FRAME_FOREIGN, modbus_serve(frame, length, reply, &reply_length));
    TEST_ASSERT_EQUAL_UINT(0, reply_length);
}

static void test_other_servers_frames_are_ignored(void) {
    uint8_t frame[MODBUS_FRAME_MAX];
    uint8_t reply[MODBUS_FRAME_MAX];
    size_t reply_length;
    for (unsigned address = 2; address < 256; address++) {
        const size_t length = master_frame(frame, (uint8_t)address, BYTES(6, 0x01, 0x01, 0, 2));
        TEST_ASSERT_EQUAL(MODBUS_FRAME_FOREIGN, modbus_serve(frame, length, reply, &reply_length));
        TEST_ASSERT_EQUAL_UINT(0, reply_length);
    }
    TEST_ASSERT_EQUAL_UINT32(0, master_get(INDEX_mode));
}

/* From here on over the line: bytes, time, the main loop. */

#define BYTE_US 95

static void send_bytes(const uint8_t *bytes, size_t count) {
    for (size_t i = 0; i < count; i++) {
        fake_board.microseconds += BYTE_US;
        modbus_server_receive(bytes[i]);
    }
}

static void be_silent(void) {
    fake_board.microseconds += FAKE_SILENCE_US + 1;
}

static size_t mode_request(uint8_t frame[MODBUS_FRAME_MAX], uint8_t mode) {
    const uint8_t pdu[] = {6, 0x01, 0x01, 0, mode};
    return master_frame(frame, MASTER_SERVER, pdu, sizeof pdu);
}

static void test_a_frame_is_served_after_the_silence_and_not_before(void) {
    uint8_t frame[MODBUS_FRAME_MAX];
    const size_t length = mode_request(frame, 1);
    be_silent();
    send_bytes(frame, length);
    TEST_ASSERT_FALSE(amplifier_serve());
    fake_board.microseconds += FAKE_SILENCE_US;
    TEST_ASSERT_FALSE(amplifier_serve());
    fake_board.microseconds += 1;
    TEST_ASSERT_TRUE(amplifier_serve());
    TEST_ASSERT_EQUAL_UINT(1, fake_board.frames_sent);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(frame, fake_board.sent, length);
    TEST_ASSERT_FALSE(amplifier_serve());
    TEST_ASSERT_EQUAL_UINT32(1, master_get(INDEX_frames_served));
    TEST_ASSERT_EQUAL_UINT32(0, master_get(INDEX_line_errors));
}

/* The main loop was away while three frames came in. */
static void test_frames_that_pile_up_are_all_served(void) {
    uint8_t frame[MODBUS_FRAME_MAX];
    for (uint8_t mode = 1; mode <= 3; mode++) {
        const size_t length = mode_request(frame, mode);
        be_silent();
        send_bytes(frame, length);
    }
    be_silent();
    TEST_ASSERT_TRUE(amplifier_serve());
    TEST_ASSERT_EQUAL_UINT(3, fake_board.frames_sent);
    TEST_ASSERT_EQUAL_UINT32(3, master_get(INDEX_mode));
}

/* Without a silence between them two frames are one, and that one is broken. */
static void test_frames_without_silence_are_one_broken_frame(void) {
    uint8_t frame[MODBUS_FRAME_MAX];
    const size_t length = mode_request(frame, 1);
    be_silent();
    send_bytes(frame, length);
    send_bytes(frame, length);
    be_silent();
    TEST_ASSERT_TRUE(amplifier_serve());
    TEST_ASSERT_EQUAL_UINT(0, fake_board.frames_sent);
    TEST_ASSERT_EQUAL_UINT32(1, master_get(INDEX_line_errors));
    TEST_ASSERT_EQUAL_UINT32(0, master_get(INDEX_mode));
}

static void test_too_long_a_frame_is_dropped_whole(void) {
    uint8_t frame[MODBUS_FRAME_MAX];
    const size_t length = mode_request(frame, 1);
    const uint8_t noise[300] = {1};
    be_silent();
    send_bytes(noise, sizeof noise);
    send_bytes(frame, length); /* a good frame as its tail */
    be_silent();
    TEST_ASSERT_TRUE(amplifier_serve());
    TEST_ASSERT_EQUAL_UINT(0, fake_board.frames_sent);
    TEST_ASSERT_EQUAL_UINT32(1, master_get(INDEX_line_errors));
    be_silent();
    send_bytes(frame, length);
    be_silent();
    (void)amplifier_serve();
    TEST_ASSERT_EQUAL_UINT_MESSAGE(1, fake_board.frames_sent, "the next frame is served");
}

static void test_a_broken_byte_drops_its_frame_and_no_other(void) {
    uint8_t frame[MODBUS_FRAME_MAX];
    const size_t length = mode_request(frame, 1);
    for (size_t broken = 0; broken <= length; broken++) {
        be_silent();
        send_bytes(frame, broken);
        fake_board.microseconds += BYTE_US;
        modbus_server_line_error();
        send_bytes(frame + broken, length - broken);
        be_silent();
        send_bytes(frame, length);
        be_silent();
        (void)amplifier_serve();
        TEST_ASSERT_EQUAL_UINT(broken + 1U, fake_board.frames_sent);
        TEST_ASSERT_EQUAL_UINT32(broken + 1U, master_get(INDEX_line_errors));
    }
}

static void test_a_flooded_ring_recovers(void) {
    uint8_t frame[MODBUS_FRAME_MAX];
    const size_t length = mode_request(frame, 2);
    for (unsigned i = 0; i < 5000; i++) {
        send_bytes(BYTES((uint8_t)i));
    }
    be_silent();
    (void)amplifier_serve();
    TEST_ASSERT_EQUAL_UINT(0, fake_board.frames_sent);
    /* The first frame after an overrun of the ring is marked with it: the byte that was lost might have been its own.
     */
    for (unsigned i = 0; i < 2; i++) {
        be_silent();
        send_bytes(frame, length);
        be_silent();
        (void)amplifier_serve();
    }
    TEST_ASSERT_EQUAL_UINT(1, fake_board.frames_sent);
    TEST_ASSERT_EQUAL_UINT32(2, master_get(INDEX_mode));
}

/* board_microseconds wraps every 71 minutes. */
static void test_framing_over_the_wrap_of_the_clock(void) {
    uint8_t frame[MODBUS_FRAME_MAX];
    const size_t length = mode_request(frame, 1);
    fake_board.microseconds = UINT32_MAX - 3 * BYTE_US;
    be_silent();
    fake_board.microseconds = UINT32_MAX - 3 * BYTE_US;
    send_bytes(frame, length);
    TEST_ASSERT_FALSE(amplifier_serve());
    be_silent();
    TEST_ASSERT_TRUE(amplifier_serve());
    TEST_ASSERT_EQUAL_UINT(1, fake_board.frames_sent);
}

static void test_clear_zeroes_the_line_counters(void) {
    be_silent();
    send_bytes(BYTES(1));
    be_silent();
    (void)amplifier_serve();
    TEST_ASSERT_EQUAL_UINT32(1, master_get(INDEX_line_errors));
    master_command(COMMAND_CLEAR);
    TEST_ASSERT_EQUAL_UINT32(0, master_get(INDEX_line_errors));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_crc_of_the_standards_example);
    RUN_TEST(test_functions_3_and_4_read_one_map);
    RUN_TEST(test_function_6_writes_one_register);
    RUN_TEST(test_function_16_writes_registers);
    RUN_TEST(test_function_23_writes_before_it_reads);
    RUN_TEST(test_function_23_reads_a_capture_as_its_write_leaves_it);
    RUN_TEST(test_function_23_refused_in_one_half_does_nothing);
    RUN_TEST(test_identification_stream_and_individual);
    RUN_TEST(test_unknown_functions);
    RUN_TEST(test_counts_out_of_range);
    RUN_TEST(test_byte_count_that_disagrees_is_exception_3);
    RUN_TEST(test_the_longest_requests);
    RUN_TEST(test_addresses_do_not_wrap);
    RUN_TEST(test_broadcast_is_executed_and_not_answered);
    RUN_TEST(test_other_servers_frames_are_ignored);
    RUN_TEST(test_a_frame_is_served_after_the_silence_and_not_before);
    RUN_TEST(test_frames_that_pile_up_are_all_served);
    RUN_TEST(test_frames_without_silence_are_one_broken_frame);
    RUN_TEST(test_too_long_a_frame_is_dropped_whole);
    RUN_TEST(test_a_broken_byte_drops_its_frame_and_no_other);
    RUN_TEST(test_a_flooded_ring_recovers);
    RUN_TEST(test_framing_over_the_wrap_of_the_clock);
    RUN_TEST(test_clear_zeroes_the_line_counters);
    return UNITY_END();
}
