/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * What a command refuses, or notes, before anything moves: the command itself, against the application behind a
 * simulated line.
 */
#include "amplifier/amplifier_image.h"
#include "base/monotonic_clock.h"
#include "command_at_line.h"
#include "loop/telemetry.h"
#include "recording/recording.h"
#include "simulated_device.h"
#include "unity.h"
#include <glob.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>

void setUp(void) {
    command_at_line_open();
}

void tearDown(void) {
    command_at_line_close();
}

/* Files are limited to what the recording cannot be. */
static void test_a_disk_without_room_is_said_before_anything_moves(void) {
    static const char *const commands[][12] = {
        {"record", "--waveform", "sine", "-n", "1", "-o", "room/room.csv", NULL},
        {"record", "--probe", "creep", "-o", "room/room.h5", NULL},
        {"track", "--waveform", "sine", "-n", "1", "--both", "-o", "room/room.csv", NULL}};
    struct rlimit before, limit;
    glob_t parts;
    (void)mkdir("room", S_IRWXU); /* other tests have such parts beside it */
    TEST_ASSERT_EQUAL_INT(0, getrlimit(RLIMIT_FSIZE, &before));
    limit = before;
    limit.rlim_cur = 10000;
    for (size_t i = 0; i < sizeof commands / sizeof commands[0]; i++) {
        (void)signal(SIGXFSZ, SIG_IGN);
        TEST_ASSERT_EQUAL_INT(0, setrlimit(RLIMIT_FSIZE, &limit));
        start(commands[i]);
        TEST_ASSERT_EQUAL_INT(0, setrlimit(RLIMIT_FSIZE, &before));
        (void)signal(SIGXFSZ, SIG_DFL);
        const int status = end();
        TEST_ASSERT_TRUE_MESSAGE(WIFEXITED(status) && WEXITSTATUS(status) == 1, errors);
        expect_error(": no room for a recording of up to ");
        TEST_ASSERT_EQUAL_UINT(0, simulated_device_line()->starts);
        TEST_ASSERT_EQUAL_INT_MESSAGE(GLOB_NOMATCH, glob("room/.hyst-*.part", 0, NULL, &parts), "a part is left");
    }
}

/* As it comes from the shelf: 1 V and 1 um are half of a converter's range, which is true of no actuator. */
static void test_an_amplifier_without_parameters_is_not_driven(void) {
    static const char *const refused[][12] = {
        {"record", "--waveform", "sine", "-o", "/dev/null", NULL},
        {"record", "--probe", "creep", "-o", "/dev/null", NULL},
        {"record", "--waveform", "sine", "-o", "/dev/null", "--drive-range", "0:100", NULL},
        {"record", "--waveform", "sine", "-o", "/dev/null", "--position-range", "0:100", NULL},
        {"track", "--waveform", "sine", "--mode", "linear", NULL}};
    static const char *const taken[] = {"record",    "--waveform",    "sine",  "--cycles",         "1",     "-o",
                                        "/dev/null", "--drive-range", "0:100", "--position-range", "0:100", NULL};
    hyst_parameters_t neutral;
    hyst_parameters_default(&neutral);
    take_line();
    must(amplifier_image_write(device, &neutral, &failure));
    leave_line();
    for (size_t i = 0; i < sizeof refused / sizeof refused[0]; i++) {
        start(refused[i]);
        const int status = end();
        TEST_ASSERT_TRUE_MESSAGE(WIFEXITED(status) && WEXITSTATUS(status) == 1, errors);
        expect_error("the amplifier has no parameters");
        expect_error("`hyst push`");
    }
    TEST_ASSERT_EQUAL_UINT(0, simulated_device_line()->starts);
    take_line();
    TEST_ASSERT_EQUAL_INT64(LOOP_PARKED, value_of(INDEX_state)); /* as it was at power-on */
    leave_line();
    start(taken);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, end(), errors);
}

/* The loop stands still: had one of these tried to move the drive, it would say so. */
static void test_what_cannot_be_played_is_refused_before_anything_moves(void) {
    static const struct {
        const char *part;
        const char *command[16];
    } refused[] = {
        {"a sine of 6000 Hz cannot be played at 10000 samples per second",
         {"record", "--waveform", "sine", "-f", "6000", "-o", "/dev/null", NULL}},
        {"a sine of 1e+09 Hz cannot be played", {"record", "--waveform", "sine", "-f", "1e9", "-o", "/dev/null", NULL}},
        {"a triangle of 6000 Hz cannot be played at 10000 samples per second",
         {"record", "--waveform", "triangle", "-f", "6000", "-o", "/dev/null", NULL}},
        {"a sine of 5000 Hz cannot be played at 10000 samples per second: only below half of that",
         {"record", "--waveform", "sine", "-f", "5000", "-o", "/dev/null", NULL}},
        {"a sine of 5000 Hz cannot be played",
         {"track", "--waveform", "multisine", "-f", "1000", "--end-frequency", "5000", "--tones", "3", "--mode",
          "linear", NULL}},
        {"a sine of 5000 Hz cannot be played", {"play", "--waveform", "sine", "-f", "5000", NULL}},
        {"a sine of 1e-07 Hz cannot be played at 10000 samples per second: the lowest frequency is 2.32833e-06 Hz",
         {"play", "--waveform", "sine", "-f", "1e-7", NULL}},
        {"a sine of 5001 Hz cannot be played",
         {"record", "--waveform", "sweep", "--end-frequency", "5001", "-o", "/dev/null", NULL}},
        {"Hz cannot be played",
         {"track", "--waveform", "multisine", "-f", "100", "--end-frequency", "6000", "--mode", "linear", NULL}},
        {"fewer than two samples", {"track", "--waveform", "sine", "--frames", "1", "--mode", "linear", NULL}},
        {"the waveform lasts ", {"record", "--waveform", "sine", "-f", "1e-5", "-o", "/dev/null", NULL}},
        {"a staircase of 2000 Hz cannot be played", {"play", "--waveform", "staircase", "-f", "2000", NULL}},
        {" breakpoints, this waveform has 3000", {"play", "--table", "long_table.csv", "--mode", "direct", NULL}},
        {"row 2: a line of more than 429497 s", {"play", "--table", "slow_table.csv", "--mode", "direct", NULL}},
        {"fine_table.csv: row 3: the line to it has no sample, at 10000 samples per second",
         {"play", "--table", "fine_table.csv", "--mode", "direct", NULL}},
        {"a triangle of 1e-06 Hz cannot be played at 10000 samples per second: the lowest frequency is 1.16416e-06 Hz",
         {"play", "--waveform", "triangle", "-f", "1e-6", NULL}},
        {"the lowest frequency is 9.31332e-08 Hz", {"play", "--waveform", "staircase", "-f", "9e-8", NULL}}};
    FILE *table = fopen("long_table.csv", "w");
    for (int row = 0; row <= 3000; row++) {
        (void)fprintf(table, "%d,%d\n", row, 20 + row % 2);
    }
    (void)fclose(table);
    table = fopen("slow_table.csv", "w");
    (void)fputs("0,20\n1000000,30\n2000000,20\n", table);
    (void)fclose(table);
    table = fopen("fine_table.csv", "w"); /* 0.7 of a sample each */
    for (int row = 0; row < 10; row++) {
        (void)fprintf(table, "%.6f,%d\n", 7e-5 * row, 20 + row % 2);
    }
    (void)fclose(table);
    simulated_device_line()->loop_stands = true;
    for (size_t i = 0; i < sizeof refused / sizeof refused[0]; i++) {
        start(refused[i].command);
        const int status = end();
        TEST_ASSERT_TRUE_MESSAGE(WIFEXITED(status) && WEXITSTATUS(status) == 1, errors);
        expect_error(refused[i].part);
        TEST_ASSERT_NULL_MESSAGE(strstr(errors, "parked"), errors);
    }
}

/* The image has 0:100 V and 0:100 um. */
static void test_ranges_that_contradict_the_image_are_noted(void) {
    static const char *const other[] = {"record", "--waveform", "sine",          "-f",    "50", "-n", "1",
                                        "-o",     "ranges.csv", "--drive-range", "0:200", NULL};
    static const char *const same[] = {"record", "--waveform", "sine",          "-f",    "50", "-n", "1",
                                       "-o",     "ranges.csv", "--drive-range", "0:100", NULL};
    recording_t recording;
    start(other);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, end(), errors);
    expect_error("note: --drive-range 0:200, where the image in force says 0:100 V: the recording has the former");
    must(recording_read(&recording, "ranges.csv", &failure));
    TEST_ASSERT_EQUAL_STRING("--drive-range 0:200, where the image in force says 0:100 V",
                             recording_key(&recording, "contradiction"));
    recording_free(&recording);
    start(same);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, end(), errors);
    TEST_ASSERT_EQUAL_STRING("", errors);
}

/* Its communication timeout has passed. */
static void trip(void) {
    take_line();
    must(device_write(device, INDEX_watchdog, 100, &failure) &&
         device_write(device, INDEX_mode, HYST_MODE_DIRECT, &failure));
    sleep_until(monotonic_s() + 0.3);
    leave_line();
}

/* What is refused, before the run is guarded or within it, leaves the amplifier in its fault, and does not say else. */
static void test_a_run_that_is_refused_after_a_trip_leads_out_of_nothing(void) {
    static const struct {
        const char *part;
        const char *command[14];
    } refused[] = {{"cannot be played", {"record", "--waveform", "sine", "-f", "6000", "-o", "/dev/null", NULL}},
                   {"cannot be played", {"track", "--waveform", "sine", "-f", "6000", "--mode", "linear", NULL}},
                   {"cannot be played", {"play", "--waveform", "sine", "-f", "6000", NULL}},
                   {"keeps its reference between",
                    {"record", "--waveform", "sine", "--offset", "80", "--amplitude", "10", "-o", "/dev/null", NULL}},
                   {"keeps its reference between",
                    {"track", "--waveform", "sine", "--offset", "80", "--amplitude", "10", "--mode", "linear", NULL}},
                   {"keeps its reference between",
                    {"play", "--waveform", "sine", "--offset", "80", "--amplitude", "10", "--mode", "direct", NULL}}};
    trip();
    take_line();
    must(device_write(device, INDEX_reference_high, 0, &failure)); /* 50 V, 50 um */
    leave_line();
    for (size_t i = 0; i < sizeof refused / sizeof refused[0]; i++) {
        start(refused[i].command);
        (void)end();
        expect_error(refused[i].part); /* one line */
    }
    take_line();
    TEST_ASSERT_EQUAL_INT64(AMPLIFIER_FAULT, value_of(INDEX_amplifier_state));
    leave_line();
}

static void test_a_run_after_a_trip_says_which(void) {
    static const char *const record[] = {"record", "--waveform", "sine", "--cycles", "1", "-o", "/dev/null", NULL};
    trip();
    start(record);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, end(), errors);
    expect_error("note: the amplifier had tripped (communication timeout); this leads it out of that fault");
    start(record);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, end(), errors);
    TEST_ASSERT_EQUAL_STRING("", errors);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_disk_without_room_is_said_before_anything_moves);
    RUN_TEST(test_an_amplifier_without_parameters_is_not_driven);
    RUN_TEST(test_what_cannot_be_played_is_refused_before_anything_moves);
    RUN_TEST(test_ranges_that_contradict_the_image_are_noted);
    RUN_TEST(test_a_run_that_is_refused_after_a_trip_leads_out_of_nothing);
    RUN_TEST(test_a_run_after_a_trip_says_which);
    return UNITY_END();
}
