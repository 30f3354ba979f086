/* SPDX-License-Identifier: MIT */
/* A board whose line has no other server and loses no byte: a request ends where it says so, without a silence. */
#include "amplifier.h"
#include "fake_board.h"
#include "master.h"
#include "registers/registers.h"
#include "unity.h"

void setUp(void) {
    fake_board_power_on(0);
}

void tearDown(void) {
}

#define BYTE_US 87U

typedef struct {
    size_t length;
    uint8_t pdu[20];
} request_t;

/* One of each function that says how long it is, and longer and shorter ones of those that write. */
static const request_t requests[] = {
    {5, {1, 0, 0, 0, 1}},
    {5, {2, 0, 0, 0, 1}},
    {5, {3, 0, 0, 0, 1}},
    {5, {4, 0, 0, 0, 1}},
    {5, {5, 0, 0, 0xFF, 0}},
    {5, {6, 1, 1, 0, 2}},
    {7, {15, 0, 0, 0, 1, 1, 0}},
    {8, {16, 1, 1, 0, 1, 2, 0, 1}},
    {10, {16, 1, 2, 0, 2, 4, 0, 1, 2, 3}},
    {7, {22, 1, 1, 0, 0, 0, 1}},
    {12, {23, 0, 0, 0, 1, 1, 1, 0, 1, 2, 0, 1}},
    {14, {23, 0, 0, 0, 1, 1, 2, 0, 2, 4, 0, 1, 2, 3}},
};
#define REQUESTS (sizeof requests / sizeof requests[0])

static void receive(uint8_t byte) {
    fake_board.microseconds += BYTE_US;
    modbus_server_receive(byte);
}

static void test_a_request_tells_its_length(void) {
    uint8_t frame[MODBUS_FRAME_MAX];
    for (size_t i = 0; i < REQUESTS; i++) {
        const size_t whole = master_frame(frame, 1, requests[i].pdu, requests[i].length);
        TEST_ASSERT_EQUAL_UINT(whole, modbus_request_length(frame, whole));
        for (size_t length = 0; length < whole; length++) {
            const size_t said = modbus_request_length(frame, length);
            TEST_ASSERT_TRUE(said == 0 || said == whole);
        }
    }
    for (unsigned function = 0; function < 256; function++) {
        const uint8_t pdu[] = {(uint8_t)function, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8};
        const size_t length = master_frame(frame, 1, pdu, sizeof pdu);
        const bool known =
            (function >= 1 && function <= 6) || function == 15 || function == 16 || function == 22 || function == 23;
        TEST_ASSERT_EQUAL(known, modbus_request_length(frame, length) != 0);
    }
}

/* Looked at after every byte: served after the last, at once. The next request may follow as soon. */
static void test_a_whole_request_is_served_without_silence(void) {
    uint8_t frame[MODBUS_FRAME_MAX];
    for (size_t i = 0; i < REQUESTS; i++) {
        const size_t length = master_frame(frame, 1, requests[i].pdu, requests[i].length);
        for (size_t at = 0; at < length; at++) {
            TEST_ASSERT_EQUAL_UINT(i, fake_board.frames_sent);
            receive(frame[at]);
            TEST_ASSERT_EQUAL(at + 1U == length, amplifier_serve());
        }
        TEST_ASSERT_EQUAL_UINT(i + 1U, fake_board.frames_sent);
        TEST_ASSERT_EQUAL_HEX8(requests[i].pdu[0], fake_board.sent[1] & 0x7FU);
    }
    TEST_ASSERT_EQUAL_UINT32(0, master_get(INDEX_line_errors));
}

/* A request that says nothing of its length, and one with a wrong CRC: by silence, as everywhere. */
static void test_any_other_frame_ends_by_silence(void) {
    uint8_t frame[MODBUS_FRAME_MAX];
    const uint8_t query[] = {8, 0, 0, 1, 2};
    for (unsigned broken = 0; broken < 2; broken++) {
        const size_t length = broken ? master_frame(frame, 1, requests[2].pdu, requests[2].length)
                                     : master_frame(frame, 1, query, sizeof query);
        frame[3] ^= (uint8_t)broken;
        for (size_t at = 0; at < length; at++) {
            receive(frame[at]);
            TEST_ASSERT_FALSE(amplifier_serve());
        }
        fake_board.microseconds += FAKE_SILENCE_US + 1;
        TEST_ASSERT_TRUE(amplifier_serve());
        TEST_ASSERT_EQUAL_UINT(1, fake_board.frames_sent); /* to the query */
        TEST_ASSERT_EQUAL_UINT32(broken, master_get(INDEX_line_errors));
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_request_tells_its_length);
    RUN_TEST(test_a_whole_request_is_served_without_silence);
    RUN_TEST(test_any_other_frame_ends_by_silence);
    return UNITY_END();
}
