/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Commands beside somebody who drives: stop, park, push, monitor, and a play that goes on. The command itself, against
 * the application behind a simulated line.
 */
#include "amplifier/device/opening.h"
#include "base/monotonic_clock.h"
#include "command_at_line.h"
#include "loop/telemetry.h"
#include "motion/source.h"
#include "simulated_device.h"
#include "unity.h"
#include <stdio.h>
#include <string.h>
#include <sys/wait.h>

void setUp(void) {
    command_at_line_open();
}

void tearDown(void) {
    command_at_line_close();
}

/* Through "-": as people see it, and not by the descriptor that it is. */
static void test_a_standard_stream_is_called_so(void) {
    static const char *const commands[][12] = {{"record", "--waveform", "sine", "-f", "50", "-n", "1", "-o", "-", NULL},
                                               {"pull", "-o", "-", NULL},
                                               {"backup", "-o", "-", NULL}};
    for (size_t i = 0; i < sizeof commands / sizeof commands[0]; i++) {
        start(commands[i]);
        TEST_ASSERT_EQUAL_INT_MESSAGE(0, end(), errors);
        expect_error("standard output: ");
    }
}

/* The amplifier does what was wanted; what fails is to tell of it. */
static void test_a_play_that_cannot_be_told_of_says_that_it_goes_on(void) {
    static const char *const text[] = {"play", "--waveform", "sine", "--mode", "direct", NULL};
    static const char *const json[] = {"play", "--waveform", "sine", "--mode", "direct", "--json", NULL};
    standard_output = "/dev/full";
    for (size_t i = 0; i < 2; i++) {
        start(i == 0 ? text : json);
        const int status = end();
        TEST_ASSERT_TRUE_MESSAGE(WIFEXITED(status) && WEXITSTATUS(status) == 1, errors);
        expect_error("the amplifier plays on, and `hyst stop` ends it: cannot write the result to stdout");
        take_line();
        TEST_ASSERT_EQUAL_INT64(LOOP_PLAYING, value_of(INDEX_state));
        leave_line();
    }
}

/* By whoever has the line. */
static void play_without_end(void) {
    must(device_write(device, INDEX_mode, HYST_MODE_DIRECT, &failure) &&
         device_write(device, INDEX_source, SOURCE_SINE, &failure) &&
         device_write(device, INDEX_source_amplitude, 1 << 30, &failure) &&
         device_write(device, INDEX_source_increment, 1 << 20, &failure) &&
         device_write(device, INDEX_source_cycles, 0, &failure) && device_command(device, COMMAND_START, &failure));
}

/* While a waveform plays without end, whose host is gone. */
static void test_stop_holds_and_park_parks(void) {
    static const char *const stop[] = {"stop", NULL};
    static const char *const park[] = {"park", "--json", NULL};
    take_line();
    play_without_end();
    TEST_ASSERT_EQUAL_INT64(LOOP_PLAYING, value_of(INDEX_state));
    leave_line();
    start(stop);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, end(), errors);
    take_line();
    TEST_ASSERT_EQUAL_INT64(LOOP_IDLE, value_of(INDEX_state));
    TEST_ASSERT_EQUAL_INT64(HYST_MODE_DIRECT, value_of(INDEX_active_mode));
    start(park);
    const int status = end();
    TEST_ASSERT_TRUE_MESSAGE(WIFEXITED(status) && WEXITSTATUS(status) == 1, errors);
    expect_error("is in use by another hyst: end that one first");
    leave_line();
    start(park);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, end(), errors);
    take_line();
    TEST_ASSERT_EQUAL_INT64(LOOP_PARKED, value_of(INDEX_state));
    leave_line();
}

/* What a command writes to its standard output; `said` holds it. */
static char said[1000];

static void run_and_read(const char *const command[]) {
    (void)remove("said.txt");
    FILE *file = fopen("said.txt", "w");
    (void)fclose(file);
    standard_output = "said.txt";
    start(command);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, end(), errors);
    standard_output = "/dev/null";
    file = fopen("said.txt", "r");
    said[fread(said, 1, sizeof said - 1, file)] = '\0';
    (void)fclose(file);
}

static void test_park_switches_off_when_it_is_to(void) {
    static const char *const park[] = {"park", NULL};
    static const char *const off[] = {"park", "--off", NULL};
    take_line();
    must(device_write(device, INDEX_mode, HYST_MODE_DIRECT, &failure));
    leave_line();
    run_and_read(park);
    TEST_ASSERT_EQUAL_STRING("stopped; the drive goes to rest, in mode park\n", said);
    run_and_read(off);
    TEST_ASSERT_EQUAL_STRING("stopped; the amplifier is off, in mode park\n", said);
    take_line();
    TEST_ASSERT_EQUAL_INT64(AMPLIFIER_OFF, value_of(INDEX_amplifier_state));
    leave_line();
}

/* On, it parks when the timeout passes; after that trip the command leads out of the fault, to off. */
static void test_stop_says_what_the_drive_does(void) {
    static const char *const stop[] = {"stop", NULL};
    take_line();
    must(device_write(device, INDEX_watchdog, 400, &failure) &&
         device_write(device, INDEX_mode, HYST_MODE_DIRECT, &failure));
    leave_line();
    run_and_read(stop);
    TEST_ASSERT_EQUAL_STRING(
        "nothing plays now; the drive holds, in mode direct; it parks after 0.4 s without a request\n", said);
    sleep_until(monotonic_s() + 0.8);
    run_and_read(stop);
    expect_error("note: the amplifier had tripped (communication timeout); this leads it out of that fault");
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(said, "nothing plays now; the "), said);
    TEST_ASSERT_NULL_MESSAGE(strstr(said, "holds"), said);
}

/* What makes safe works with a map of another version, as command keeps its place and these codes. */
static void test_stop_and_park_take_any_register_map(void) {
    static const char *const stop[] = {"stop", NULL};
    static const char *const off[] = {"park", "--off", "--json", NULL};
    take_line();
    play_without_end();
    leave_line();
    simulated_device_fault(LINE_LIES, 1, 2); /* magic is good, abi is one more */
    run_and_read(stop);
    TEST_ASSERT_EQUAL_STRING("the amplifier has taken the command; what it does now is not read: its register map "
                             "version 5 is unknown here\n",
                             said);
    take_line();
    TEST_ASSERT_EQUAL_INT64(LOOP_IDLE, value_of(INDEX_state));
    leave_line();
    simulated_device_fault(LINE_LIES, 1, 2);
    run_and_read(off);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(said, "\"state\": null"), said);
    take_line();
    expect_goes_off();
    leave_line();
}

/* Another master drives, with keys that it has written itself: they are its own after a push, too. */
static void test_a_push_leaves_the_keys_to_who_drives(void) {
    static const char *const image[] = {"pull", "-o", "pushed.image", NULL};
    static const char *const pushes[] = {"push", "pushed.image", NULL};
    start(image);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, end(), errors);
    for (int driven = 1; driven >= 0; driven--) {
        take_line();
        must(device_write(device, INDEX_mode, driven ? HYST_MODE_DIRECT : HYST_MODE_PARK, &failure));
        device_forget_locks(device);
        leave_line();
        start(pushes);
        TEST_ASSERT_EQUAL_INT_MESSAGE(0, end(), errors);
        if (driven) {
            expect_error("note: the amplifier is driven, in mode direct: the image takes over meanwhile");
        } else {
            TEST_ASSERT_EQUAL_STRING("", errors);
        }
        device = device_open(&options, &failure);
        TEST_ASSERT_NOT_NULL_MESSAGE(device, failure.text);
        TEST_ASSERT_EQUAL_INT64(driven ? CONTROL_PARAMETERS | CONTROL_OUTPUT : 0, value_of(INDEX_unlocked));
        leave_line();
    }
}

/* And not the wrap of the sample's number, 0.3 s after it begins. */
static void test_monitor_notes_a_restart(void) {
    static const char *const monitor[] = {"monitor", "--interval", "0.05", "--count", "20", NULL};
    simulated_device_line()->sequence = (uint32_t)0 - 30000U;
    take_line();
    leave_line();
    start(monitor);
    sleep_until(monotonic_s() + 0.6);
    simulated_device_line()->restart_after = 1;
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, end(), errors);
    expect_error("note: the amplifier restarted; how long it was away is not in the time");
}

/* Where the loop stands still nothing can take effect, and neither command says that it did. */
static void test_a_loop_that_stands_is_not_called_parked(void) {
    static const char *const park[] = {"park", NULL};
    take_line();
    must(device_write(device, INDEX_mode, HYST_MODE_DIRECT, &failure));
    TEST_ASSERT_EQUAL_INT64(LOOP_IDLE, value_of(INDEX_state));
    leave_line();
    simulated_device_line()->loop_stands = true;
    start(park);
    const int status = end();
    TEST_ASSERT_TRUE_MESSAGE(WIFEXITED(status) && WEXITSTATUS(status) == 1, errors);
    expect_error("its loop is still idle");
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_standard_stream_is_called_so);
    RUN_TEST(test_a_play_that_cannot_be_told_of_says_that_it_goes_on);
    RUN_TEST(test_stop_holds_and_park_parks);
    RUN_TEST(test_park_switches_off_when_it_is_to);
    RUN_TEST(test_stop_says_what_the_drive_does);
    RUN_TEST(test_stop_and_park_take_any_register_map);
    RUN_TEST(test_a_push_leaves_the_keys_to_who_drives);
    RUN_TEST(test_monitor_notes_a_restart);
    RUN_TEST(test_a_loop_that_stands_is_not_called_parked);
    return UNITY_END();
}
