/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The Modbus client against lines that lose, delay, damage and repeat: it recovers, or says in one line what is wrong.
 */
#include "amplifier/amplifier_image.h"
#include "amplifier/device/arming.h"
#include "amplifier/device/device.h"
#include "amplifier/device/opening.h"
#include "base/monotonic_clock.h"
#include "base/provenance.h"
#include "client_at_line.h"
#include "hyst/compensator.h"
#include "loop/capture.h"
#include "simulated_device.h"
#include "unity.h"
#include <fcntl.h>
#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/wait.h>
#include <termios.h>
#include <unistd.h>

/* For what surely comes to an end. */
#define PATIENCE_S 20.0

void setUp(void) {
    client_at_line_open();
}

void tearDown(void) {
    client_at_line_close();
}

static void test_identity(void) {
    open_device();
    TEST_ASSERT_EQUAL_INT(REGISTERS_MAGIC, device_identity(device, INDEX_magic));
    TEST_ASSERT_EQUAL_INT(0, device_identity(device, INDEX_board));
    TEST_ASSERT_EQUAL_INT(CAPTURE_CAPACITY, device_identity(device, INDEX_capture_capacity));
    TEST_ASSERT_TRUE(device_sample_rate_hz(device) == 10000.0);
    TEST_ASSERT_EQUAL_UINT(0, device_repetitions(device));
}

/* Pages and recordings say which amplifier it was. */
static void test_results_name_the_device(void) {
    provenance_t from;
    provenance_note_t *note = provenance_note();
    (void)provenance_enter(note);
    open_device();
    provenance_now(&from);
    TEST_ASSERT_NOT_NULL(from.device);
    TEST_ASSERT_NOT_NULL(strstr(from.device, "board "));
    TEST_ASSERT_NOT_NULL(strstr(from.device, options.port));
    provenance_free(&from);
    (void)provenance_enter(NULL);
    provenance_note_free(note);
}

static void test_values_of_every_width_and_sign_come_back(void) {
    static const int64_t fractions[] = {0, 1, -1, INT32_MAX, INT32_MIN, 0x12345678, -0x12345678};
    open_device();
    for (size_t i = 0; i < sizeof fractions / sizeof fractions[0]; i++) {
        TEST_ASSERT_TRUE(device_write(device, INDEX_source_offset, fractions[i], &failure));
        TEST_ASSERT_EQUAL_INT64(fractions[i], read_register(INDEX_source_offset));
    }
    TEST_ASSERT_TRUE(device_write(device, INDEX_source_increment, UINT32_MAX, &failure));
    TEST_ASSERT_EQUAL_INT64(UINT32_MAX, read_register(INDEX_source_increment));
    TEST_ASSERT_TRUE(device_write(device, INDEX_capture_decimation, UINT16_MAX, &failure));
    TEST_ASSERT_EQUAL_INT64(UINT16_MAX, read_register(INDEX_capture_decimation));
}

/* Every count up to four requests, at an offset, so that every way of cutting the block is used. */
static void test_blocks_are_cut_into_requests_and_put_together_again(void) {
    uint16_t out[400];
    uint16_t in[400];
    open_device();
    for (size_t count = 4; count <= 400; count += 36) {
        for (size_t i = 0; i < count; i++) {
            out[i] = (uint16_t)(i * 257U + count);
        }
        TEST_ASSERT_TRUE_MESSAGE(device_write_block(device, ADDRESS_waveform, 8, count, out, &failure), failure.text);
        memset(in, 0, sizeof in);
        TEST_ASSERT_TRUE_MESSAGE(device_read_block(device, ADDRESS_waveform, 8, count, in, &failure), failure.text);
        TEST_ASSERT_EQUAL_HEX16_ARRAY(out, in, count);
    }
}

static void test_one_or_two_lost_requests_or_answers_are_made_good(void) {
    open_device();
    const line_fault_t faults[] = {LINE_LOSES_REQUEST, LINE_LOSES_ANSWER};
    for (unsigned times = 1; times <= 2; times++) {
        for (size_t i = 0; i < 2; i++) {
            const unsigned long before = device_repetitions(device);
            simulated_device_fault(faults[i], 0, times);
            TEST_ASSERT_EQUAL_INT(CAPTURE_CAPACITY, read_register(INDEX_capture_length));
            TEST_ASSERT_EQUAL_UINT(before + times, device_repetitions(device));
        }
    }
}

static void test_silence_is_one_line_and_the_line_works_again_afterwards(void) {
    int64_t value;
    open_device();
    simulated_device_fault(LINE_LOSES_REQUEST, 0, 3);
    TEST_ASSERT_FALSE(device_read(device, INDEX_mode, &value, &failure));
    expect_line("no answer from ");
    expect_line(options.port);
    expect_line("(slave 1) after 3 tries, reading register mode");
    TEST_ASSERT_EQUAL_INT(0, read_register(INDEX_mode));
}

static void test_nobody_there(void) {
    options.slave = 7; /* the device is number 1 */
    refuses_to_open("no answer from ");
    expect_line("(slave 7)");
}

/* A client was killed while it waited, and its answer comes when the next one has opened the line: an answer of the
 * same shape, of another register. */
static void test_an_answer_to_somebody_who_has_gone_is_dropped(void) {
    static const uint8_t read_mode[] = {1, 3, 0x01, 0x01, 0, 1, 0xD4, 0x36};
    simulated_device_line()->delay_ms = (unsigned)(TIMEOUT_S * 1000.0 / 3.0);
    simulated_device_fault(LINE_DELAYS, 0, 1);
    const int line = open(options.port, O_RDWR | O_NOCTTY);
    TEST_ASSERT_EQUAL_INT((int)sizeof read_mode, (int)write(line, read_mode, sizeof read_mode));
    while (simulated_device_line()->requests == 0) {
        sleep_until(monotonic_s() + 0.001); /* it has arrived, and the answer is under way */
    }
    (void)close(line);
    open_device();
    TEST_ASSERT_EQUAL_INT(CAPTURE_CAPACITY, read_register(INDEX_capture_length));
}

static void test_slow_answers_within_the_timeout_need_no_repetition(void) {
    open_device();
    simulated_device_line()->delay_ms = (unsigned)(TIMEOUT_S * 1000.0 / 3.0);
    simulated_device_fault(LINE_DELAYS, 0, 3);
    for (int i = 0; i < 3; i++) {
        TEST_ASSERT_EQUAL_INT(CAPTURE_CAPACITY, read_register(INDEX_capture_length));
    }
    TEST_ASSERT_EQUAL_UINT(0, device_repetitions(device));
}

/*
 * The answer of one request arrives while the client waits for the next one, which has an answer of the same shape. Ten
 * different delays around one, two and three timeouts: whatever the client was doing then, no value may be another
 * register's.
 */
static void test_a_late_answer_is_never_taken_for_another(void) {
    open_device();
    TEST_ASSERT_TRUE(device_write(device, INDEX_capture_length, 1111, &failure));
    TEST_ASSERT_TRUE(device_write(device, INDEX_capture_decimation, 2222, &failure));
    for (unsigned percent = 105; percent <= 285; percent += 20) {
        simulated_device_line()->delay_ms = (unsigned)(TIMEOUT_S * 10.0 * percent);
        simulated_device_fault(LINE_DELAYS, 0, 1);
        TEST_ASSERT_EQUAL_INT(1111, read_register(INDEX_capture_length));
        TEST_ASSERT_EQUAL_INT(2222, read_register(INDEX_capture_decimation));
        TEST_ASSERT_EQUAL_INT(1111, read_register(INDEX_capture_length));
    }
    TEST_ASSERT_GREATER_OR_EQUAL_UINT(10, device_repetitions(device));
}

static void test_damaged_answers_are_made_good(void) {
    static const line_fault_t faults[] = {LINE_FLIPS_BIT,    LINE_CUTS, LINE_WRONG_SLAVE,
                                          LINE_NOISE_BEFORE, LINE_BUSY, LINE_ECHOES};
    open_device();
    for (size_t i = 0; i < sizeof faults / sizeof faults[0]; i++) {
        simulated_device_fault(faults[i], 0, 2);
        TEST_ASSERT_EQUAL_INT(CAPTURE_CAPACITY, read_register(INDEX_capture_length));
        uint16_t block[100];
        simulated_device_fault(faults[i], 0, 1);
        TEST_ASSERT_TRUE_MESSAGE(device_read_block(device, ADDRESS_active, 0, 100, block, &failure), failure.text);
        TEST_ASSERT_EQUAL_HEX16(0x4859, block[0]);
        TEST_ASSERT_EQUAL_HEX16(0x5354, block[1]);
    }
    TEST_ASSERT_GREATER_OR_EQUAL_UINT(3 * sizeof faults / sizeof faults[0], device_repetitions(device));
}

/* Each time as soon as something has come, and before the device has read it. */
static void *take_answers(void *context) {
    const int thief = *(const int *)context;
    uint8_t taken[256];
    while (read(thief, taken, sizeof taken) > 0) {
    }
    return NULL;
}

/* As a terminal that was left open: which answers it takes is chance. On a busy machine it may come too late for many,
 * so there are requests until it has taken some, and the few runs in which it gets none have tested nothing. */
static void test_another_reader_of_the_line(void) {
    enum { REQUESTS = 8, MOST = 400 };
    int thief = open(options.port, O_RDWR | O_NOCTTY);
    struct termios mode;
    pthread_t thread;
    unsigned named = 0, requests = 0;
    TEST_ASSERT_TRUE(thief >= 0);
    open_device();
    TEST_ASSERT_EQUAL_INT(0, tcgetattr(thief, &mode));
    mode.c_cc[VMIN] = 1; /* as terminals have it: they wait for a byte */
    TEST_ASSERT_EQUAL_INT(0, tcsetattr(thief, TCSANOW, &mode));
    TEST_ASSERT_EQUAL_INT(0, pthread_create(&thread, NULL, take_answers, &thief));
    for (; requests < REQUESTS || (device_repetitions(device) == 0 && requests < MOST); requests++) {
        int64_t value;
        if (!device_read(device, INDEX_mode, &value, &failure)) {
            TEST_ASSERT_NULL_MESSAGE(strstr(failure.text, "the line is gone"), failure.text);
            named += strstr(failure.text, "another program takes the answers from this line") != NULL ? 1U : 0U;
        }
    }
    TEST_ASSERT_EQUAL_INT(0, pthread_cancel(thread));
    TEST_ASSERT_EQUAL_INT(0, pthread_join(thread, NULL));
    (void)close(thief);
    printf("another reader is named in %u of %u requests, and took %u answers\n", named, requests,
           (unsigned)device_repetitions(device));
    TEST_ASSERT_EQUAL_INT(0, read_register(INDEX_mode)); /* and without it all is well again */
}

static void test_damage_that_stays_is_one_line(void) {
    int64_t value;
    open_device();
    simulated_device_fault(LINE_FLIPS_BIT, 0, 1000);
    TEST_ASSERT_FALSE(device_read(device, INDEX_mode, &value, &failure));
    expect_line("damaged answers in 3 tries, reading register mode");
    simulated_device_fault(LINE_BUSY, 0, 1000);
    TEST_ASSERT_FALSE(device_read(device, INDEX_mode, &value, &failure));
    expect_line("(exception 6)");
}

static void test_a_line_that_echoes_is_named(void) {
    simulated_device_fault(LINE_ECHOES, 0, 1000);
    refuses_to_open("switch off the local echo");
}

static void test_a_register_map_of_the_future_is_refused(void) {
    simulated_device_fault(LINE_LIES, 1, 2); /* magic is good, abi is one more */
    refuses_to_open("register map version 5 is unknown here (known: 4): upgrade hyst");
}

static void test_something_else_is_not_taken_for_an_amplifier(void) {
    simulated_device_fault(LINE_LIES, 0, 2);
    refuses_to_open("is not a hyst amplifier: register magic is 0x485A");
}

static void test_refusals_name_register_value_and_exception(void) {
    open_device();
    TEST_ASSERT_FALSE(device_write(device, INDEX_mode, 17, &failure));
    expect_line("refuses writing 17 to register mode: Illegal data value (exception 3)");
    TEST_ASSERT_FALSE(device_write(device, INDEX_position, 1, &failure));
    expect_line("register position: Illegal data address (exception 2)");
    TEST_ASSERT_FALSE(device_command(device, COMMAND_START, &failure)); /* parked */
    TEST_ASSERT_EQUAL_UINT(0, device_repetitions(device));
}

static void test_an_unplugged_device(void) {
    int64_t value;
    open_device();
    simulated_device_fault(LINE_HANGS_UP, 0, 1);
    TEST_ASSERT_FALSE(device_read(device, INDEX_mode, &value, &failure));
    expect_line(options.port);
}

static void test_a_device_that_is_unplugged_meanwhile_is_not_called_another_one(void) {
    simulated_device_fault(LINE_HANGS_UP, 0, 1);
    TEST_ASSERT_NULL(device_open(&options, &failure));
    expect_line("the line is gone");
    TEST_ASSERT_NULL_MESSAGE(strstr(failure.text, "is not a hyst amplifier"), failure.text);
}

static void test_ports_that_are_none(void) {
    options.port = "/dev/no-such-port";
    refuses_to_open("cannot open /dev/no-such-port: No such file or directory");
    options.port = "/dev/null";
    refuses_to_open("cannot open /dev/null: not a serial port");
}

/* Unlocked is what was unlocked here, until the device is closed; a locked write says so in one line. */
static void test_locks(void) {
    int64_t unlocked = 0;
    device = device_open(&options, &failure);
    TEST_ASSERT_NOT_NULL_MESSAGE(device, failure.text);
    TEST_ASSERT_FALSE(device_write(device, INDEX_watchdog, 500, &failure));
    expect_line("to register watchdog: Slave device or server failure (exception 4); its parameters are locked");
    TEST_ASSERT_FALSE(device_write(device, INDEX_setpoint, 500, &failure));
    expect_line("(exception 4); its output is locked");
    TEST_ASSERT_TRUE_MESSAGE(device_unlock(device, CONTROL_OUTPUT, &failure), failure.text);
    TEST_ASSERT_TRUE_MESSAGE(device_write(device, INDEX_setpoint, 500, &failure), failure.text);
    TEST_ASSERT_FALSE(device_write(device, INDEX_watchdog, 500, &failure));
    device_close(device);
    device = device_open(&options, &failure);
    TEST_ASSERT_NOT_NULL_MESSAGE(device, failure.text);
    TEST_ASSERT_TRUE(device_read(device, INDEX_unlocked, &unlocked, &failure));
    TEST_ASSERT_EQUAL_INT64(0, unlocked);
}

static bool until(void *end_s, failure_t *why) {
    return monotonic_s() < *(const double *)end_s || fail(why, "it waits without end");
}

/* Ten times slower than by the clock: precharge lasts long enough to be ended by another master, at rest or still on
 * the way there, as after an image that parks elsewhere. */
static void test_an_arming_that_somebody_takes_back_says_so(void) {
    static const hyst_q31_t park[] = {0, 1 << 30};
    hyst_parameters_t image;
    double end_s = monotonic_s() + PATIENCE_S;
    hyst_parameters_default(&image);
    image.transition_slew = 1 << 20;
    open_device();
    for (size_t i = 0; i < sizeof park / sizeof park[0]; i++) {
        simulated_device_line()->samples_per_ms = 0;
        TEST_ASSERT_TRUE(device_command(device, COMMAND_DISARM, &failure) &&
                         device_expect_off(device, "nothing", &failure));
        simulated_device_line()->samples_per_ms = 1;
        image.drive_park = park[i];
        TEST_ASSERT_TRUE_MESSAGE(amplifier_image_write(device, &image, &failure), failure.text);
        simulated_device_line()->disarm_after = 9; /* six until it is armed, then one each 20 ms */
        device_take_turns(device, until, &end_s);
        TEST_ASSERT_FALSE(device_arm(device, &failure));
        expect_line("somebody else has switched the amplifier off while it was armed here");
        TEST_ASSERT_EQUAL_UINT(0, simulated_device_line()->disarm_after);
        device_take_turns(device, NULL, NULL);
    }
}

/* 0.1 s of precharge begin anew with each request, which is 0.09 s: 13 s of its time, and no sooner. */
static void test_a_precharge_without_end_is_given_up(void) {
    enum { SAMPLES = 900 };
    double end_s = monotonic_s() + PATIENCE_S;
    open_device();
    TEST_ASSERT_TRUE(device_command(device, COMMAND_DISARM, &failure) &&
                     device_expect_off(device, "nothing", &failure));
    simulated_device_line()->samples_per_request = SAMPLES;
    simulated_device_line()->arms_anew = true;
    const int64_t before = read_register(INDEX_sequence);
    device_take_turns(device, until, &end_s);
    TEST_ASSERT_FALSE(device_arm(device, &failure));
    device_take_turns(device, NULL, NULL);
    expect_line("the amplifier is still in precharge after 13 s of its time: does somebody else arm it anew?");
    TEST_ASSERT_INT_WITHIN(20 * SAMPLES, 130000 + 10 * SAMPLES, read_register(INDEX_sequence) - before);
}

/* Nor is its terminal set to another rate, not for a moment: the amplifier would not understand a request then. */
static void test_a_port_in_use_keeps_its_rate(void) {
    open_device();
    const pid_t other = fork();
    if (other == 0) {
        options.baud = 9600;
        for (;;) {
            device_close(device_open(&options, &failure));
        }
    }
    for (int i = 0; i < 1000; i++) {
        (void)read_register(INDEX_state);
    }
    TEST_ASSERT_EQUAL_INT(0, kill(other, SIGKILL));
    TEST_ASSERT_EQUAL_INT(other, waitpid(other, NULL, 0));
    TEST_ASSERT_EQUAL_UINT64(0, device_repetitions(device));
}

static void test_a_port_in_use_is_left_alone(void) {
    open_device();
    TEST_ASSERT_NULL(device_open(&options, &failure));
    expect_line("is in use by another hyst");
    TEST_ASSERT_EQUAL_INT(0, read_register(INDEX_mode));
}

/* Whether the request or the answer is lost, the source starts exactly once, and the capture has its beginning. */
static void test_start_is_never_executed_twice(void) {
    const line_fault_t faults[] = {LINE_GOOD, LINE_LOSES_REQUEST, LINE_LOSES_ANSWER, LINE_FLIPS_BIT};
    open_device();
    TEST_ASSERT_TRUE(device_write(device, INDEX_mode, HYST_MODE_DIRECT, &failure));
    TEST_ASSERT_TRUE(device_write(device, INDEX_source, 1, &failure));
    TEST_ASSERT_TRUE(device_write(device, INDEX_source_increment, 1 << 16, &failure));
    TEST_ASSERT_TRUE(device_write(device, INDEX_capture_trigger, CAPTURE_AT_SOURCE, &failure));
    for (unsigned i = 0; i < sizeof faults / sizeof faults[0]; i++) {
        TEST_ASSERT_TRUE(device_command(device, COMMAND_STOP, &failure));
        TEST_ASSERT_TRUE(device_command(device, COMMAND_ARM_CAPTURE, &failure));
        simulated_device_fault(faults[i], 0, faults[i] == LINE_GOOD ? 0 : 1);
        TEST_ASSERT_TRUE_MESSAGE(device_start(device, &failure), failure.text);
        TEST_ASSERT_EQUAL_UINT(i + 1, simulated_device_line()->starts);
        for (int look = 0; look < 100 && read_register(INDEX_capture_state) == CAPTURE_ARMED; look++) {
        }
        TEST_ASSERT_GREATER_OR_EQUAL_INT(CAPTURE_RUNNING, read_register(INDEX_capture_state));
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_identity);
    RUN_TEST(test_results_name_the_device);
    RUN_TEST(test_values_of_every_width_and_sign_come_back);
    RUN_TEST(test_blocks_are_cut_into_requests_and_put_together_again);
    RUN_TEST(test_one_or_two_lost_requests_or_answers_are_made_good);
    RUN_TEST(test_silence_is_one_line_and_the_line_works_again_afterwards);
    RUN_TEST(test_nobody_there);
    RUN_TEST(test_an_answer_to_somebody_who_has_gone_is_dropped);
    RUN_TEST(test_slow_answers_within_the_timeout_need_no_repetition);
    RUN_TEST(test_a_late_answer_is_never_taken_for_another);
    RUN_TEST(test_damaged_answers_are_made_good);
    RUN_TEST(test_another_reader_of_the_line);
    RUN_TEST(test_damage_that_stays_is_one_line);
    RUN_TEST(test_a_line_that_echoes_is_named);
    RUN_TEST(test_a_register_map_of_the_future_is_refused);
    RUN_TEST(test_something_else_is_not_taken_for_an_amplifier);
    RUN_TEST(test_refusals_name_register_value_and_exception);
    RUN_TEST(test_an_unplugged_device);
    RUN_TEST(test_a_device_that_is_unplugged_meanwhile_is_not_called_another_one);
    RUN_TEST(test_ports_that_are_none);
    RUN_TEST(test_locks);
    RUN_TEST(test_an_arming_that_somebody_takes_back_says_so);
    RUN_TEST(test_a_precharge_without_end_is_given_up);
    RUN_TEST(test_a_port_in_use_is_left_alone);
    RUN_TEST(test_a_port_in_use_keeps_its_rate);
    RUN_TEST(test_start_is_never_executed_twice);
    return UNITY_END();
}
