/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Nobody leaves the actuator driven by accident: the command itself, with real signals, against the application behind
 * a simulated line.
 */
#include "base/monotonic_clock.h"
#include "command_at_line.h"
#include "loop/telemetry.h"
#include "recording/recording.h"
#include "simulated_device.h"
#include "unity.h"
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
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

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_signals_stop_and_park);
    RUN_TEST(test_a_signal_at_any_time_leaves_the_amplifier_parked);
    RUN_TEST(test_a_killed_host_leaves_the_amplifier_to_park_by_itself);
    RUN_TEST(test_a_starved_amplifier_does_not_take_its_master_for_silent);
    RUN_TEST(test_an_error_parks);
    RUN_TEST(test_a_recording_that_cannot_be_written_parks);
    RUN_TEST(test_a_recording_that_has_no_room_at_its_end_is_written_elsewhere);
    RUN_TEST(test_a_complete_recording_is_kept_if_the_amplifier_cannot_be_disarmed);
    RUN_TEST(test_a_line_that_is_cut_is_reported_and_the_amplifier_parks_by_itself);
    RUN_TEST(test_a_good_run_ends_off_and_leaves_the_timeout_as_it_was);
    RUN_TEST(test_a_restart_leaves_no_recording);
    return UNITY_END();
}
