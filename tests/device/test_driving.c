/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Nobody leaves the actuator driven by accident: the command itself, with real signals, against the application behind
 * a simulated line.
 */
#include "amplifier/amplifier_image.h"
#include "amplifier/driving.h"
#include "amplifier/opening.h"
#include "base/monotonic_clock.h"
#include "command_at_line.h"
#include "loop/telemetry.h"
#include "motion/source.h"
#include "recording/recording.h"
#include "simulated_device.h"
#include "unity.h"
#include <fcntl.h>
#include <glob.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <termios.h>
#include <unistd.h>

void setUp(void) {
    TEST_ASSERT_EQUAL_INT(0, setenv("TMPDIR", ".", 1)); /* of what finds no room */
    command_at_line_open();
}

void tearDown(void) {
    command_at_line_close();
}

/* Runs for minutes if it is not ended: the simulated loop makes ten seconds' samples a second. */
#define RECORD "record", "--waveform", "triangle", "--frequency", "0.01", "--cycles", "4"
#define TRACK  "track", "--waveform", "sine", "--frequency", "1", "--cycles", "2000", "--both"

static void expect_goes_off(void) {
    const double until_s = monotonic_s() + PATIENCE_S;
    while (value_of(INDEX_amplifier_state) == AMPLIFIER_STOP && monotonic_s() < until_s) {
        sleep_until(monotonic_s() + 0.01);
    }
    TEST_ASSERT_EQUAL_INT64(AMPLIFIER_OFF, value_of(INDEX_amplifier_state));
}

/* Parked and off, and not because of the communication timeout, which is off again. */
static void expect_parked_by_command(void) {
    take_line();
    TEST_ASSERT_EQUAL_INT64(LOOP_PARKED, value_of(INDEX_state));
    expect_goes_off();
    TEST_ASSERT_EQUAL_INT64(0, value_of(INDEX_faults_sticky));
    TEST_ASSERT_EQUAL_INT64(0, value_of(INDEX_watchdog));
    leave_line();
}

static void parks_after_signal(const char *const command[], int number, const char *name) {
    simulated_device_line()->starts = 0;
    start(command);
    wait_for_start();
    TEST_ASSERT_EQUAL_INT(0, kill(process, number));
    const int status = end();
    TEST_ASSERT_TRUE_MESSAGE(WIFSIGNALED(status) && WTERMSIG(status) == number, errors);
    expect_error(name);
    expect_error("the drive is stopped and parked");
    expect_parked_by_command();
}

static void test_signals_stop_and_park(void) {
    static const char *const record[] = {RECORD, "-o", "/dev/null", NULL};
    static const char *const track[] = {TRACK, NULL};
    static const char *const probe[] = {"record", "--probe", "creep", "-o", "/dev/null", NULL};
    parks_after_signal(record, SIGINT, "hyst: interrupted (SIGINT)");
    parks_after_signal(record, SIGTERM, "hyst: interrupted (SIGTERM)");
    parks_after_signal(track, SIGINT, "hyst: interrupted (SIGINT)");
    parks_after_signal(track, SIGHUP, "hyst: interrupted (SIGHUP)");
    parks_after_signal(probe, SIGINT, "hyst: interrupted (SIGINT)");
}

/* From before the line is opened to after the sweep: each 30 ms, whatever the command is doing then. */
static void test_a_signal_at_any_time_leaves_the_amplifier_parked(void) {
    static const char *const record[] = {RECORD, "-o", "/dev/null", NULL};
    for (int ms = 0; ms <= 600; ms += 30) {
        start(record);
        sleep_until(monotonic_s() + ms / 1000.0);
        TEST_ASSERT_EQUAL_INT(0, kill(process, SIGINT));
        const int status = end();
        TEST_ASSERT_TRUE_MESSAGE(WIFSIGNALED(status) && WTERMSIG(status) == SIGINT, errors);
        take_line();
        TEST_ASSERT_EQUAL_INT64_MESSAGE(LOOP_PARKED, value_of(INDEX_state), errors);
        leave_line();
    }
}

static void expect_parks_by_itself(double within_s) {
    const double until_s = monotonic_s() + within_s;
    sleep_until(until_s); /* without a request: one would keep it going */
    take_line();
    TEST_ASSERT_EQUAL_INT64(LOOP_PARKED, value_of(INDEX_state));
    TEST_ASSERT_NOT_EQUAL(0, value_of(INDEX_faults_sticky) & 4); /* the watchdog */
    leave_line();
}

/* The communication timeout is 1 s; another one for a busy machine. */
static void test_a_killed_host_leaves_the_amplifier_to_park_by_itself(void) {
    static const char *const record[] = {RECORD, "-o", "/dev/null", NULL};
    start(record);
    wait_for_start();
    TEST_ASSERT_EQUAL_INT(0, kill(process, SIGKILL));
    (void)end();
    expect_parks_by_itself(2.0);
}

/* The amplifier's process waits for a processor while a request waits for it: the master was not silent. */
static void test_a_starved_amplifier_does_not_take_its_master_for_silent(void) {
    static const uint8_t read_mode[] = {1, 3, 0x01, 0x01, 0, 1, 0xD4, 0x36};
    take_line();
    must(device_write(device, INDEX_watchdog, 300, &failure) &&
         device_write(device, INDEX_mode, HYST_MODE_DIRECT, &failure));
    const int line = open(options.port, O_RDWR | O_NOCTTY);
    simulated_device_pause(true);
    TEST_ASSERT_EQUAL_INT((int)sizeof read_mode, (int)write(line, read_mode, sizeof read_mode));
    sleep_until(monotonic_s() + 0.6);
    const unsigned requests = simulated_device_line()->requests;
    simulated_device_pause(false);
    while (simulated_device_line()->requests == requests) {
        sleep_until(monotonic_s() + 0.001);
    }
    sleep_until(monotonic_s() + 0.02);
    (void)tcflush(line, TCIFLUSH); /* the answer */
    (void)close(line);
    TEST_ASSERT_EQUAL_INT64(LOOP_IDLE, value_of(INDEX_state));
    TEST_ASSERT_EQUAL_INT64(0, value_of(INDEX_faults_sticky));
}

static void test_an_error_parks(void) {
    static const char *const record[] = {RECORD, "-o", "/dev/null", NULL};
    start(record);
    wait_for_start();
    simulated_device_fault(LINE_LOSES_REQUEST, 5, 3); /* as many as the command tries */
    const int status = end();
    TEST_ASSERT_TRUE_MESSAGE(WIFEXITED(status) && WEXITSTATUS(status) == 1, errors);
    expect_error("no answer from ");
    expect_error("; the drive is stopped and parked");
    expect_parked_by_command();
}

static void test_a_recording_that_cannot_be_written_parks(void) {
    static const char *const record[] = {"record", "--waveform", "sine", "--cycles", "1", "-o", "/dev/full", NULL};
    start(record);
    const int status = end();
    TEST_ASSERT_TRUE_MESSAGE(WIFEXITED(status) && WEXITSTATUS(status) == 1, errors);
    expect_error("/dev/full: ");
    expect_error("; the drive is stopped and parked");
    expect_parked_by_command();
}

/* Behind the words that name it: where the recording is. */
static void expect_recording_elsewhere(const char *ending, size_t samples, int column) {
    static const char words[] = "what was recorded is in ";
    recording_t recording;
    char path[200] = "";
    const char *const at = strstr(errors, words);
    TEST_ASSERT_NOT_NULL_MESSAGE(at, errors);
    TEST_ASSERT_EQUAL_INT(1, sscanf(at + strlen(words), "%199[^;\n]", path));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(path, ending), path);
    must(recording_read(&recording, path, &failure));
    TEST_ASSERT_EQUAL_UINT(samples, recording.samples);
    TEST_ASSERT_NOT_NULL(recording.column[column]);
    recording_free(&recording);
    (void)remove(path);
    *strrchr(path, '/') = '\0';
    TEST_ASSERT_EQUAL_INT(0, rmdir(path)); /* it has a folder for itself */
}

static void test_a_recording_that_has_no_room_at_its_end_is_written_elsewhere(void) {
    static const char *const record[] = {"record", "--waveform", "sine", "-f",        "10",
                                         "-n",     "1",          "-o",   "/dev/full", NULL};
    static const char *const track[] = {"track", "--waveform", "sine",   "-f", "10",        "-n",
                                        "1",     "-m",         "linear", "-o", "/dev/full", NULL};
    start(record);
    (void)end();
    expect_error("/dev/full: could not be written: No space left on device; what was recorded is in ./hyst-");
    expect_recording_elsewhere("/recording.csv", 1000, COLUMN_DRIVE);
    expect_parked_by_command();
    start(track);
    (void)end();
    expect_recording_elsewhere("/recording.csv", 1000, COLUMN_REFERENCE);
    expect_parked_by_command();
}

/* Files are limited to what the recording cannot be. */
static void test_a_disk_without_room_is_said_before_anything_moves(void) {
    static const char *const commands[][12] = {
        {"record", "--waveform", "sine", "-n", "1", "-o", "room.csv", NULL},
        {"record", "--probe", "creep", "-o", "room.h5", NULL},
        {"track", "--waveform", "sine", "-n", "1", "--both", "-o", "room.csv", NULL}};
    struct rlimit before, limit;
    glob_t parts;
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
        TEST_ASSERT_EQUAL_INT_MESSAGE(GLOB_NOMATCH, glob(".hyst-*.part", 0, NULL, &parts), "a part is left");
    }
}

/* All of it had been read when the last request was lost. */
static void keeps_what_is_complete(const char *const command[], int column) {
    recording_t recording;
    (void)remove("complete.csv");
    simulated_device_line()->lost_disarms = 3; /* as many as the command tries */
    start(command);
    const int status = end();
    TEST_ASSERT_TRUE_MESSAGE(WIFEXITED(status) && WEXITSTATUS(status) == 1, errors);
    TEST_ASSERT_EQUAL_UINT_MESSAGE(0, simulated_device_line()->lost_disarms, errors);
    expect_error("hyst: the recording is complete, but the amplifier was not disarmed: no answer from ");
    expect_error("; the drive is stopped and parked");
    must(recording_read(&recording, "complete.csv", &failure));
    TEST_ASSERT_EQUAL_UINT(1000, recording.samples);
    TEST_ASSERT_NOT_NULL(recording.column[column]);
    recording_free(&recording);
    expect_parked_by_command();
}

static void test_a_complete_recording_is_kept_if_the_amplifier_cannot_be_disarmed(void) {
    static const char *const record[] = {"record", "--waveform", "sine", "-f",           "10",
                                         "-n",     "1",          "-o",   "complete.csv", NULL};
    static const char *const track[] = {"track", "--waveform", "sine",   "-f", "10",           "-n",
                                        "1",     "-m",         "linear", "-o", "complete.csv", NULL};
    static const char *const full[] = {"record", "--waveform", "sine", "-f", "10", "-n", "1", "-o", "/dev/full", NULL};
    keeps_what_is_complete(record, COLUMN_DRIVE);
    keeps_what_is_complete(track, COLUMN_REFERENCE);
    simulated_device_line()->lost_disarms = 3;
    start(full);
    (void)end();
    expect_error("/dev/full: ");
    expect_parked_by_command();
}

static void test_a_line_that_is_cut_is_reported_and_the_amplifier_parks_by_itself(void) {
    static const char *const record[] = {RECORD, "-o", "/dev/null", NULL};
    start(record);
    wait_for_start();
    simulated_device_fault(LINE_LOSES_REQUEST, 5, 6); /* the parking is lost, too */
    const int status = end();
    TEST_ASSERT_TRUE_MESSAGE(WIFEXITED(status) && WEXITSTATUS(status) == 1, errors);
    expect_error("without requests it parks by itself after 1 s");
    expect_parks_by_itself(2.0);
}

static void test_a_good_run_ends_off_and_leaves_the_timeout_as_it_was(void) {
    static const char *const record[] = {"record", "--waveform", "sine", "--cycles", "1", "-o", "/dev/null", NULL};
    take_line();
    must(device_write(device, INDEX_watchdog, 54321, &failure));
    leave_line();
    start(record);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, end(), errors);
    TEST_ASSERT_EQUAL_STRING("", errors);
    take_line();
    TEST_ASSERT_EQUAL_INT64(54321, value_of(INDEX_watchdog));
    TEST_ASSERT_EQUAL_INT64(LOOP_PARKED, value_of(INDEX_state));
    TEST_ASSERT_EQUAL_INT64(HYST_MODE_PARK, value_of(INDEX_mode));
    leave_line();
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

/* The older file stays, and the line says why. */
static void test_a_restart_leaves_no_recording(void) {
    static const char *const record[] = {"record", "--waveform", "sine", "--cycles", "1", "-o", "restarted.csv", NULL};
    char content[10] = "";
    FILE *file = fopen("restarted.csv", "w");
    (void)fputs("older", file);
    (void)fclose(file);
    simulated_device_line()->restart_at_capture = true;
    simulated_device_line()->restart_after = 20;
    start(record);
    const int status = end();
    TEST_ASSERT_TRUE_MESSAGE(WIFEXITED(status) && WEXITSTATUS(status) == 1, errors);
    expect_error("hyst: the amplifier restarted: what was set in it and not stored is gone");
    file = fopen("restarted.csv", "r");
    content[fread(content, 1, sizeof content - 1, file)] = '\0';
    (void)fclose(file);
    TEST_ASSERT_EQUAL_STRING("older", content);
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
    RUN_TEST(test_signals_stop_and_park);
    RUN_TEST(test_a_signal_at_any_time_leaves_the_amplifier_parked);
    RUN_TEST(test_a_killed_host_leaves_the_amplifier_to_park_by_itself);
    RUN_TEST(test_a_starved_amplifier_does_not_take_its_master_for_silent);
    RUN_TEST(test_an_error_parks);
    RUN_TEST(test_a_recording_that_cannot_be_written_parks);
    RUN_TEST(test_a_recording_that_has_no_room_at_its_end_is_written_elsewhere);
    RUN_TEST(test_a_disk_without_room_is_said_before_anything_moves);
    RUN_TEST(test_a_complete_recording_is_kept_if_the_amplifier_cannot_be_disarmed);
    RUN_TEST(test_a_line_that_is_cut_is_reported_and_the_amplifier_parks_by_itself);
    RUN_TEST(test_a_good_run_ends_off_and_leaves_the_timeout_as_it_was);
    RUN_TEST(test_an_amplifier_without_parameters_is_not_driven);
    RUN_TEST(test_what_cannot_be_played_is_refused_before_anything_moves);
    RUN_TEST(test_ranges_that_contradict_the_image_are_noted);
    RUN_TEST(test_a_standard_stream_is_called_so);
    RUN_TEST(test_a_play_that_cannot_be_told_of_says_that_it_goes_on);
    RUN_TEST(test_stop_holds_and_park_parks);
    RUN_TEST(test_park_switches_off_when_it_is_to);
    RUN_TEST(test_stop_says_what_the_drive_does);
    RUN_TEST(test_stop_and_park_take_any_register_map);
    RUN_TEST(test_a_push_leaves_the_keys_to_who_drives);
    RUN_TEST(test_a_run_that_is_refused_after_a_trip_leads_out_of_nothing);
    RUN_TEST(test_a_run_after_a_trip_says_which);
    RUN_TEST(test_monitor_notes_a_restart);
    RUN_TEST(test_a_restart_leaves_no_recording);
    RUN_TEST(test_a_loop_that_stands_is_not_called_parked);
    return UNITY_END();
}
