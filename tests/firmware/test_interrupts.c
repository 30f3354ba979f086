/* SPDX-License-Identifier: MIT */
/*
 * What the interrupts share with the main loop, under real interruption: a timer signal plays the interrupt and strikes
 * between any two instructions, while the main loop does nothing but what can be disturbed.
 */
#include "amplifier.h"
#include "fake_board.h"
#include "loop/telemetry.h"
#include "master.h"
#include "unity.h"
#include <signal.h>
#include <string.h>
#include <sys/time.h>

enum { INTERRUPTS = 4000, PERIOD_US = 50 };

static volatile sig_atomic_t interrupts;

void setUp(void) {
    fake_board_power_on(0);
    interrupts = 0;
}

static void set_timer(long period_us, void (*handler)(int)) {
    struct sigaction action = {.sa_handler = handler};
    const struct itimerval timer = {.it_interval = {.tv_usec = period_us}, .it_value = {.tv_usec = period_us}};
    TEST_ASSERT_EQUAL_INT(0, sigaction(SIGALRM, &action, NULL));
    TEST_ASSERT_EQUAL_INT(0, setitimer(ITIMER_REAL, &timer, NULL));
}

void tearDown(void) {
    set_timer(0, SIG_IGN);
}

/* A sample in which every word is the same number. */
static void publish_next(int signal) {
    (void)signal;
    interrupts = interrupts + 1;
    static telemetry_t sample;
    uint32_t words[sizeof sample / sizeof(uint32_t)];
    for (size_t i = 0; i < sizeof words / sizeof words[0]; i++) {
        words[i] = (uint32_t)interrupts;
    }
    memcpy(&sample, words, sizeof sample);
    telemetry_publish(&sample);
}
_Static_assert(sizeof(telemetry_t) % sizeof(uint32_t) == 0, "telemetry is words");

static void test_telemetry_is_never_torn(void) {
    publish_next(0);
    set_timer(PERIOD_US, publish_next);
    while (interrupts < INTERRUPTS) {
        telemetry_t sample;
        uint32_t words[sizeof sample / sizeof(uint32_t)];
        telemetry_read(&sample);
        sample.capture_state = sample.capture_frames = sample.sequence; /* not the interrupt's: filled in on reading */
        memcpy(words, &sample, sizeof sample);
        for (size_t i = 1; i < sizeof words / sizeof words[0]; i++) {
            TEST_ASSERT_EQUAL_UINT32(words[0], words[i]);
        }
    }
}

static uint8_t request[MODBUS_FRAME_MAX];
static size_t request_length;
static size_t next_byte;

/* A byte of an endless row of requests, with the silence after each of them. */
static void receive_next(int signal) {
    (void)signal;
    interrupts = interrupts + 1;
    fake_board.microseconds += 90;
    if (next_byte < request_length) {
        modbus_server_receive(request[next_byte++]);
    } else {
        fake_board.microseconds += FAKE_SILENCE_US;
        next_byte = 0;
    }
}

static void test_no_frame_is_lost_or_split(void) {
    static const uint8_t pdu[] = {3, 0, 0, 0, 2};
    request_length = master_frame(request, MASTER_SERVER, pdu, sizeof pdu);
    next_byte = 0;
    fake_board.microseconds += 2 * FAKE_SILENCE_US;
    set_timer(PERIOD_US, receive_next);
    while (interrupts < INTERRUPTS) {
        (void)amplifier_serve();
    }
    set_timer(0, SIG_IGN);
    fake_board.microseconds += 2 * FAKE_SILENCE_US;
    (void)amplifier_serve();
    const modbus_counters_t counters = modbus_server_counters();
    const unsigned whole = (unsigned)interrupts / (unsigned)(request_length + 1U);
    const unsigned left = (unsigned)interrupts % (unsigned)(request_length + 1U);
    /* The last one may have been cut by the end of the test. */
    TEST_ASSERT_EQUAL_UINT(whole + (left == request_length ? 1U : 0U), counters.served);
    TEST_ASSERT_EQUAL_UINT(left != 0 && left != request_length ? 1U : 0U, counters.errors);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_telemetry_is_never_torn);
    RUN_TEST(test_no_frame_is_lost_or_split);
    return UNITY_END();
}
