/* SPDX-License-Identifier: MIT */
/*
 * A line that returns what the amplifier sends: an RS-485 adapter or a repeater with a local echo. The amplifier must
 * not talk to itself, must not execute a request twice, and must not take its own answers for signs of life of a
 * master.
 */
#include "amplifier.h"
#include "fake_board.h"
#include "loop/loop.h"
#include "master.h"
#include "unity.h"
#include <string.h>

enum { BYTE_US = 87, ROUNDS = 50 };

void setUp(void) {
    fake_board_power_on(0);
}
void tearDown(void) {
}

static void be_silent(uint32_t microseconds) {
    fake_board.microseconds += microseconds;
}

static void arrive(const uint8_t *bytes, size_t length) {
    for (size_t i = 0; i < length; i++) {
        fake_board.microseconds += BYTE_US;
        modbus_server_receive(bytes[i]);
    }
}

/* The frame arrives, and each answer comes back `echo_delay_us` after it was sent, as often as there is one. Returns
 * how many answers there were. */
static unsigned converse(const uint8_t *frame, size_t length, uint32_t echo_delay_us) {
    const unsigned before = fake_board.frames_sent;
    be_silent(2 * FAKE_SILENCE_US);
    arrive(frame, length);
    for (unsigned round = 0; round < ROUNDS; round++) {
        const unsigned sent = fake_board.frames_sent;
        (void)fake_board_run(FAKE_SILENCE_US / FAKE_SAMPLE_US + 1);
        (void)amplifier_serve();
        if (fake_board.frames_sent > sent) {
            uint8_t echo[MODBUS_FRAME_MAX];
            const size_t echo_length = fake_board.sent_length;
            memcpy(echo, fake_board.sent, echo_length);
            be_silent(echo_delay_us);
            arrive(echo, echo_length);
        }
    }
    return fake_board.frames_sent - before;
}

static size_t request(uint8_t frame[MODBUS_FRAME_MAX], const uint8_t *pdu, size_t length) {
    return master_frame(frame, MASTER_SERVER, pdu, length);
}

/* Reads, writes, identification, an exception, a broken request: one answer each, whatever comes back. */
static void test_one_answer_to_each_request(void) {
    static const struct {
        size_t length;
        uint8_t pdu[12];
    } requests[] = {{5, {3, 0, 0, 0, 1}},
                    {5, {3, 0x02, 0, 0, 33}},
                    {5, {4, 0, 0, 0, 2}},
                    {5, {6, 0x01, 0x04, 0, 1}},
                    {8, {16, 0x01, 0x04, 0, 1, 2, 0, 2}},
                    {12, {23, 0, 0, 0, 1, 0x01, 0x04, 0, 1, 2, 0, 1}},
                    {4, {43, 14, 1, 0}},
                    {1, {99}},
                    {5, {3, 0x30, 0, 0, 1}},
                    {2, {16, 0}}};
    for (size_t i = 0; i < sizeof requests / sizeof requests[0]; i++) {
        uint8_t frame[MODBUS_FRAME_MAX];
        const size_t length = request(frame, requests[i].pdu, requests[i].length);
        fake_board_power_on(0);
        TEST_ASSERT_EQUAL_UINT(1, converse(frame, length, 100));
        TEST_ASSERT_EQUAL_UINT(1, converse(frame, length, 100));
        if (requests[i].pdu[0] == 6) { /* a line that has returned an answer as late, which a master's copy cannot be */
            uint8_t first[MODBUS_FRAME_MAX];
            TEST_ASSERT_EQUAL_UINT(1, converse(first, request(first, requests[0].pdu, 5), FAKE_SILENCE_US));
        }
        TEST_ASSERT_EQUAL_UINT(1, converse(frame, length, FAKE_SILENCE_US));
        /* Later than an echo can be: what is no request is still not answered endlessly. */
        const unsigned late = converse(frame, length, 20 * FAKE_SILENCE_US);
        TEST_ASSERT_TRUE(late <= 2 || requests[i].pdu[0] == 6);
    }
}

/* The answer to function 6 is its request. A command that acts at each execution shows how often there was one. */
static void test_an_echoed_function_6_is_not_executed(void) {
    static const uint8_t pdu[] = {6, ADDRESS_command >> 8, ADDRESS_command & 0xFF, 0, COMMAND_LATCH};
    uint8_t frame[MODBUS_FRAME_MAX];
    uint16_t first[2], second[2];
    const size_t length = request(frame, pdu, sizeof pdu);
    (void)fake_board_run(1);
    TEST_ASSERT_EQUAL_UINT(1, converse(frame, length, 100));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_read(ADDRESS_sequence + 1, 1, first));
    (void)fake_board_run(5);
    be_silent(2 * FAKE_SILENCE_US);
    (void)amplifier_serve();
    TEST_ASSERT_EQUAL(MODBUS_OK, master_read(ADDRESS_sequence + 1, 1, second));
    TEST_ASSERT_EQUAL_UINT16_MESSAGE(first[0], second[0], "the echo latched telemetry");
    TEST_ASSERT_EQUAL_UINT32(1, master_get(INDEX_line_echoes));
    /* The same request again, by a master that keeps the pause of the standard, is a request. */
    TEST_ASSERT_EQUAL_UINT(1, converse(frame, length, 100));
    TEST_ASSERT_EQUAL_UINT32(2, master_get(INDEX_line_echoes));
}

/* The next request of a fast master, without the pause that would part it from the echo. */
static void test_a_request_right_behind_an_echo_is_served(void) {
    static const uint8_t pdu[] = {3, 0, 0, 0, 1};
    uint8_t frame[MODBUS_FRAME_MAX], echo[MODBUS_FRAME_MAX];
    const size_t length = request(frame, pdu, sizeof pdu);
    be_silent(2 * FAKE_SILENCE_US);
    arrive(frame, length);
    be_silent(FAKE_SILENCE_US + 1);
    TEST_ASSERT_TRUE(amplifier_serve());
    TEST_ASSERT_EQUAL_UINT(1, fake_board.frames_sent);
    const size_t echo_length = fake_board.sent_length;
    memcpy(echo, fake_board.sent, echo_length);
    arrive(echo, echo_length);
    arrive(frame, length);
    be_silent(FAKE_SILENCE_US + 1);
    TEST_ASSERT_TRUE(amplifier_serve());
    TEST_ASSERT_EQUAL_UINT(2, fake_board.frames_sent);
    TEST_ASSERT_EQUAL_UINT8_ARRAY(echo, fake_board.sent, echo_length);
}

/* An answer has a function code of 0x80 or more, or is one of another server: neither is a request. */
static void test_no_answer_to_an_exception(void) {
    for (unsigned function = 0x80; function <= 0xFF; function++) {
        const uint8_t pdu[] = {(uint8_t)function, 1};
        uint8_t frame[MODBUS_FRAME_MAX];
        TEST_ASSERT_EQUAL_UINT(0, converse(frame, request(frame, pdu, sizeof pdu), 100));
    }
    TEST_ASSERT_EQUAL_UINT32(0, master_get(INDEX_frames_served));
}

/* Only what a master asks and gets feeds the communication timeout. */
static void feed_and_expect(const uint8_t *frame, size_t length, bool fed) {
    fake_board_power_on(0);
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_watchdog, 100));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_mode, HYST_MODE_DIRECT));
    (void)fake_board_run(900);
    arrive(frame, length);
    be_silent(FAKE_SILENCE_US + 1);
    (void)amplifier_serve();
    (void)fake_board_run(500);
    TEST_ASSERT_EQUAL(fed ? HYST_MODE_DIRECT : HYST_MODE_PARK, loop_mode());
}

static void test_only_accepted_requests_feed_the_timeout(void) {
    static const struct {
        size_t length;
        uint8_t address;
        bool feeds;
        uint8_t pdu[12];
    } cases[] = {{5, 1, true, {3, 0, 0, 0, 1}},
                 {5, 1, true, {6, 0x01, 0x04, 0, 1}},
                 {5, 0, true, {6, 0x01, 0x00, 0, COMMAND_LATCH}},
                 {5, 0, false, {6, 0x01, 0x04, 0, 1}}, /* not for all at once */
                 {5, 0, false, {6, 0x01, 0x04, 0, 77}},
                 {5, 1, false, {6, 0x01, 0x04, 0, 77}},
                 {5, 1, false, {3, 0x30, 0, 0, 1}},
                 {4, 1, false, {3, 0x30, 0, 0}},
                 {1, 1, false, {99}},
                 {2, 1, false, {0x83, 2}},
                 {5, 2, false, {3, 0, 0, 0, 1}}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        uint8_t frame[MODBUS_FRAME_MAX];
        const size_t length = master_frame(frame, cases[i].address, cases[i].pdu, cases[i].length);
        feed_and_expect(frame, length, cases[i].feeds);
        frame[length - 1U] ^= 1U;
        feed_and_expect(frame, length, false);
    }
}

/* The master asked once, then fell silent; its line echoes without end. */
static void test_an_echo_does_not_feed_the_timeout(void) {
    static const uint8_t read[] = {3, 0, 0, 0, 1}, write[] = {6, ADDRESS_source >> 8, ADDRESS_source & 0xFF, 0, 1};
    for (unsigned which = 0; which < 2; which++) {
        uint8_t frame[MODBUS_FRAME_MAX];
        fake_board_power_on(0);
        TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_watchdog, 50));
        TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_mode, HYST_MODE_DIRECT));
        (void)converse(frame, request(frame, which == 0 ? read : write, 5), 100); /* 50 rounds of 1.8 ms */
        TEST_ASSERT_EQUAL(HYST_MODE_PARK, loop_mode());
    }
}

/* The main loop was busy: when it answers, there is already something behind the request. The echo comes after both. */
static void test_an_echo_behind_what_waited_for_the_answer(void) {
    static const uint8_t pdu[] = {6, 0x01, 0x04, 0, 1}, noise[] = {0x55, 0xAA, 0x55, 0xAA, 0x55};
    uint8_t frame[MODBUS_FRAME_MAX], echo[MODBUS_FRAME_MAX];
    const size_t length = request(frame, pdu, sizeof pdu);
    be_silent(2 * FAKE_SILENCE_US);
    arrive(frame, length);
    be_silent(2 * FAKE_SILENCE_US);
    arrive(noise, sizeof noise);
    be_silent(2 * FAKE_SILENCE_US);
    const unsigned before = fake_board.frames_sent;
    (void)amplifier_serve();
    TEST_ASSERT_EQUAL_UINT(before + 1U, fake_board.frames_sent);
    const uint32_t heard = modbus_server_accepted();
    memcpy(echo, fake_board.sent, fake_board.sent_length);
    arrive(echo, fake_board.sent_length);
    be_silent(2 * FAKE_SILENCE_US);
    (void)amplifier_serve();
    TEST_ASSERT_EQUAL_UINT_MESSAGE(before + 1U, fake_board.frames_sent, "answered its own answer");
    TEST_ASSERT_EQUAL_UINT32_MESSAGE(heard, modbus_server_accepted(), "executed a request twice");
}

/* Without an echo: the frame, its answer, and the time from the answer's end to the next frame. */
static void ask(const uint8_t *frame, size_t length, uint32_t pause_us) {
    arrive(frame, length);
    be_silent(FAKE_SILENCE_US + 1);
    (void)amplifier_serve();
    be_silent(pause_us);
}

/* A master asks what it talks to before it works. */
static void meet(void) {
    static const uint8_t read[] = {3, 0, 0, 0, 2};
    uint8_t frame[MODBUS_FRAME_MAX];
    const size_t length = request(frame, read, sizeof read);
    be_silent(2 * FAKE_SILENCE_US);
    for (unsigned i = 0; i < 4; i++) {
        ask(frame, length, 200);
    }
}

/* Requests that are equal to their answers, one behind the other: by a master that waits for the standard's silence,
 * and by one that does not. */
static void test_a_line_without_an_echo_loses_no_repeated_write(void) {
    static const struct {
        size_t length;
        uint8_t pdu[7];
    } writes[] = {{5, {5, 0, 0, 0xFF, 0}},
                  {5, {6, ADDRESS_command >> 8, ADDRESS_command & 0xFF, 0, COMMAND_LATCH}},
                  {5, {8, 0, 0, 0x12, 0x34}},
                  {7, {22, ADDRESS_source >> 8, ADDRESS_source & 0xFF, 0, 0, 0, 1}}};
    static const uint32_t pauses[] = {0, 100, FAKE_SILENCE_US, FAKE_SILENCE_US + BYTE_US,
                                      2 * FAKE_SILENCE_US - BYTE_US};
    for (size_t i = 0; i < sizeof writes / sizeof writes[0]; i++) {
        for (size_t k = 0; k < sizeof pauses / sizeof pauses[0]; k++) {
            uint8_t frame[MODBUS_FRAME_MAX];
            const size_t length = request(frame, writes[i].pdu, writes[i].length);
            fake_board_power_on(0);
            meet();
            const unsigned before = fake_board.frames_sent;
            for (unsigned times = 1; times <= 20; times++) {
                ask(frame, length, pauses[k]);
                TEST_ASSERT_EQUAL_UINT_MESSAGE(before + times, fake_board.frames_sent, "a write was lost");
            }
            TEST_ASSERT_EQUAL_UINT32(0, master_get(INDEX_line_echoes));
        }
    }
}

/* Nothing but the same write, from the start on, or once noise has followed on an answer: by a master that leaves a
 * silence after each answer. An echo begins at once. */
static void test_no_repeated_write_is_lost_by_a_master_that_keeps_the_silence(void) {
    static const uint8_t write[] = {6, ADDRESS_source >> 8, ADDRESS_source & 0xFF, 0, 1}, noise[] = {0x55, 0xAA};
    static const uint32_t pauses[] = {FAKE_SILENCE_US, FAKE_SILENCE_US + BYTE_US, 2 * FAKE_SILENCE_US - BYTE_US,
                                      3 * FAKE_SILENCE_US};
    for (size_t i = 0; i < sizeof pauses / sizeof pauses[0]; i++) {
        uint8_t frame[MODBUS_FRAME_MAX];
        const size_t length = request(frame, write, sizeof write);
        fake_board_power_on(0);
        be_silent(2 * FAKE_SILENCE_US);
        for (unsigned times = 0; times < 20; times++) {
            const unsigned before = fake_board.frames_sent;
            ask(frame, length, pauses[i]);
            TEST_ASSERT_EQUAL_UINT_MESSAGE(before + 1U, fake_board.frames_sent, "a write was lost");
            if (times % 5 == 4) {
                arrive(noise, sizeof noise);
                be_silent(2 * FAKE_SILENCE_US);
                (void)amplifier_serve();
            }
        }
        TEST_ASSERT_EQUAL_UINT32(0, master_get(INDEX_line_echoes));
    }
}

/* What holds for a hasty master on a line that has not shown yet that it has no echo: its copy is dropped, and the
 * repetition after its timeout is served. */
static void test_a_hasty_copy_is_dropped_until_the_line_has_shown_that_it_has_no_echo(void) {
    static const uint8_t write[] = {6, ADDRESS_source >> 8, ADDRESS_source & 0xFF, 0, 1};
    uint8_t frame[MODBUS_FRAME_MAX];
    const size_t length = request(frame, write, sizeof write);
    be_silent(2 * FAKE_SILENCE_US);
    ask(frame, length, 100);
    const unsigned before = fake_board.frames_sent;
    ask(frame, length, 10 * FAKE_SILENCE_US);
    TEST_ASSERT_EQUAL_UINT(before, fake_board.frames_sent);
    ask(frame, length, FAKE_SILENCE_US);
    TEST_ASSERT_EQUAL_UINT(before + 1U, fake_board.frames_sent);
    meet();
    be_silent(FAKE_SILENCE_US);
    for (unsigned times = 2; times < 10; times++) {
        ask(frame, length, 100);
        TEST_ASSERT_EQUAL_UINT(before + 4U + times, fake_board.frames_sent);
    }
}

/* And one that begins to echo later on, slowly: the writes that a dead master has left behind may go round until
 * another answer comes back, but they are no sign of its life. */
static void test_a_line_that_begins_to_echo_does_not_feed_the_timeout(void) {
    static const uint8_t write[] = {6, ADDRESS_source >> 8, ADDRESS_source & 0xFF, 0, 1}, read[] = {3, 0, 0, 0, 1};
    uint8_t frame[MODBUS_FRAME_MAX];
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_watchdog, 50));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_mode, HYST_MODE_DIRECT));
    meet();
    (void)converse(frame, request(frame, write, sizeof write), 100);
    TEST_ASSERT_EQUAL(HYST_MODE_PARK, loop_mode());
    be_silent(2 * FAKE_SILENCE_US);
    (void)amplifier_serve(); /* the last one of them */
    TEST_ASSERT_EQUAL_UINT(1, converse(frame, request(frame, read, sizeof read), 100));
    TEST_ASSERT_EQUAL_UINT(1, converse(frame, request(frame, write, sizeof write), 100));
}

/* A repeater with a delay: of a long answer only the end is heard, as the amplifier is deaf while it sends; a short
 * answer comes back whole. */
static void test_the_end_of_an_echo_is_none_to_be_trusted(void) {
    static const uint8_t write[] = {6, ADDRESS_source >> 8, ADDRESS_source & 0xFF, 0, 1}, read[] = {3, 2, 0, 0, 33};
    uint8_t frame[MODBUS_FRAME_MAX], echo[MODBUS_FRAME_MAX];
    for (unsigned i = 0; i < 20; i++) {
        ask(frame, request(frame, read, sizeof read), 0);
        TEST_ASSERT_GREATER_THAN_UINT(60, fake_board.sent_length);
        memcpy(echo, fake_board.sent, fake_board.sent_length);
        arrive(echo + fake_board.sent_length - 12U, 12);
        be_silent(2 * FAKE_SILENCE_US);
        (void)amplifier_serve();
    }
    TEST_ASSERT_EQUAL_UINT(1, converse(frame, request(frame, write, sizeof write), 300));
}

/* One that returns what is sent while it is sent does so whatever was before: no master talks then. */
static const uint8_t *returned;

static void return_it(const uint8_t *bytes, size_t length) {
    returned = bytes;
    arrive(bytes, length);
}

static void test_what_comes_while_it_is_sent_is_an_echo(void) {
    static const uint8_t write[] = {6, ADDRESS_source >> 8, ADDRESS_source & 0xFF, 0, 1};
    uint8_t frame[MODBUS_FRAME_MAX];
    const size_t length = request(frame, write, sizeof write);
    meet();
    const unsigned before = fake_board.frames_sent;
    returned = NULL;
    fake_board_sends = return_it;
    ask(frame, length, 200);
    fake_board_sends = NULL;
    TEST_ASSERT_NOT_NULL(returned);
    for (unsigned round = 0; round < 5; round++) {
        be_silent(2 * FAKE_SILENCE_US);
        (void)amplifier_serve();
    }
    TEST_ASSERT_EQUAL_UINT(before + 1U, fake_board.frames_sent);
    TEST_ASSERT_EQUAL_UINT32(1, master_get(INDEX_line_echoes));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_one_answer_to_each_request);
    RUN_TEST(test_an_echoed_function_6_is_not_executed);
    RUN_TEST(test_a_request_right_behind_an_echo_is_served);
    RUN_TEST(test_no_answer_to_an_exception);
    RUN_TEST(test_only_accepted_requests_feed_the_timeout);
    RUN_TEST(test_an_echo_does_not_feed_the_timeout);
    RUN_TEST(test_an_echo_behind_what_waited_for_the_answer);
    RUN_TEST(test_a_line_without_an_echo_loses_no_repeated_write);
    RUN_TEST(test_no_repeated_write_is_lost_by_a_master_that_keeps_the_silence);
    RUN_TEST(test_a_hasty_copy_is_dropped_until_the_line_has_shown_that_it_has_no_echo);
    RUN_TEST(test_a_line_that_begins_to_echo_does_not_feed_the_timeout);
    RUN_TEST(test_the_end_of_an_echo_is_none_to_be_trusted);
    RUN_TEST(test_what_comes_while_it_is_sent_is_an_echo);
    return UNITY_END();
}
