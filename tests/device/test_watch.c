/* SPDX-License-Identifier: GPL-3.0-or-later */
/* `hyst watch`: neither a full disk, nor Ctrl-C, nor its end takes the line, or the amplifier, with it. */
#include "amplifier/device/opening.h"
#include "base/monotonic_clock.h"
#include "chain/model.h"
#include "command_at_line.h"
#include "compile/compile.h"
#include "loop/telemetry.h"
#include "simulated_device.h"
#include "unity.h"
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

static pid_t diagnosis; /* the command's child, which does not end with it */

void setUp(void) {
    command_at_line_open();
}

void tearDown(void) {
    if (diagnosis > 0) {
        (void)kill(diagnosis, SIGKILL);
        diagnosis = 0;
    }
    command_at_line_close();
}

/* An amplifier at work, with the model watched.json. */
static void play_what_is_watched(void) {
    static const char *const play[] = {"play", "--waveform", "sine", "-f", "20", "--no-condition", NULL};
    model_t model;
    FILE *file = fopen("watched.json", "w");
    (void)fputs(
        "{\"format\": \"hyst-model-1\", \"sample_rate_hz\": 1000, \"chain\": [{\"block\":"
        " \"prandtl_ishlinskii\", \"parameters\": {\"offset_um\": {\"value\": 0}, \"weights\": {\"value\": [1, 0.1]},"
        " \"thresholds_v\": {\"value\": [1]}}}]}",
        file);
    (void)fclose(file);
    must(model_read(&model, "watched.json", &failure));
    push(compile_model_id(&model)); /* only a model that is in force is watched with */
    model_free(&model);
    start(play);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, end(), errors);
}

/* It watches from when it has measured what is usual, and says so. */
static void start_watch(const char *const argument[]) {
    static const char said[] = "watched.out";
    char line[200] = "";
    FILE *file = fopen(said, "w");
    TEST_ASSERT_NOT_NULL(file);
    (void)fclose(file);
    standard_output = said;
    start(argument);
    const double until_s = monotonic_s() + PATIENCE_S;
    while (strchr(line, '\n') == NULL && monotonic_s() < until_s) {
        sleep_until(monotonic_s() + 0.01);
        file = fopen(said, "r");
        TEST_ASSERT_NOT_NULL(file);
        line[0] = '\0';
        (void)fgets(line, sizeof line, file);
        (void)fclose(file);
    }
    if (strncmp(line, "watching: ", strlen("watching: ")) != 0) {
        (void)kill(process, SIGKILL);
        (void)end();
        TEST_FAIL_MESSAGE(errors[0] != '\0' ? errors : "the watch has not begun, and says nothing");
    }
}

/* A disk that fills up, a folder that is taken away: the amplifier would park if the watch ended. */
static void test_a_watch_whose_folder_is_gone_goes_on(void) {
    static const char *const watch[] = {"watch",  "--model", "watched.json", "--report", "watched", "--limit", "1",
                                        "--time", "0.3",     "--before",     "0.8",      "--after", "0.3",     "-n",
                                        "2",      NULL};
    (void)rmdir("watched");
    play_what_is_watched();
    start_watch(watch);
    TEST_ASSERT_EQUAL_INT(0, rmdir("watched"));
    simulated_device_line()->position_offset = 3000;
    wait_for_line();
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(errors, "hyst: watched/"), errors);
    sleep_until(monotonic_s() + 1.0);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, waitpid(process, NULL, WNOHANG), "it has ended");
    TEST_ASSERT_EQUAL_INT(0, kill(process, SIGINT));
    (void)end();
    take_line();
    TEST_ASSERT_EQUAL_INT64(LOOP_PLAYING, value_of(INDEX_state));
    leave_line();
}

/* Stands still, for as long as the test wants the diagnosis to last. */
static void hold_diagnosis(void) {
    char path[64], text[64];
    pid_t child = 0;
    (void)snprintf(path, sizeof path, "/proc/%d/task/%d/children", (int)process, (int)process);
    const double until_s = monotonic_s() + PATIENCE_S;
    while (child == 0 && monotonic_s() < until_s) {
        FILE *file = fopen(path, "r");
        TEST_ASSERT_NOT_NULL(file);
        child = fgets(text, sizeof text, file) != NULL ? (pid_t)strtol(text, NULL, 10) : 0;
        (void)fclose(file);
        sleep_until(monotonic_s() + 0.002); /* others need the processor */
    }
    TEST_ASSERT_NOT_EQUAL_MESSAGE(0, child, "no diagnosis has begun");
    sleep_until(monotonic_s() + 0.2); /* until it has closed the port */
    TEST_ASSERT_EQUAL_INT(0, kill(child, SIGSTOP));
    diagnosis = child;
}

static void watch_until_it_diagnoses(void) {
    static const char *const watch[] = {"watch", "--model", "watched.json", "--report", "diagnosed", NULL};
    play_what_is_watched();
    start_watch(watch);
    simulated_device_line()->position_offset = 3000;
    hold_diagnosis();
}

/* Neither the amplifier nor other commands wait for a page. */
static void test_a_watch_that_is_interrupted_frees_the_line_before_its_page_is_written(void) {
    watch_until_it_diagnoses();
    TEST_ASSERT_EQUAL_INT(0, kill(process, SIGINT));
    const double until_s = monotonic_s() + PATIENCE_S;
    while ((device = device_open(&options, &failure)) == NULL && monotonic_s() < until_s) {
        sleep_until(monotonic_s() + 0.01);
    }
    leave_line();
    take_line();
    TEST_ASSERT_EQUAL_INT64(LOOP_PLAYING, value_of(INDEX_state));
    TEST_ASSERT_EQUAL_INT64(0, value_of(INDEX_model_error_limit));
    leave_line();
    wait_for_line();
    TEST_ASSERT_EQUAL_STRING("note: the line is free; waiting for the page of the last warning", errors);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, waitpid(process, NULL, WNOHANG), "it has ended without the page");
    TEST_ASSERT_EQUAL_INT(0, kill(diagnosis, SIGKILL));
    diagnosis = 0;
    const int status = end();
    TEST_ASSERT_TRUE_MESSAGE(WIFEXITED(status) && WEXITSTATUS(status) == 1, errors);
    expect_error("hyst: a diagnosis failed; its record is in diagnosed");
}

static void test_a_watch_that_is_killed_leaves_no_lock(void) {
    watch_until_it_diagnoses();
    TEST_ASSERT_EQUAL_INT(0, kill(process, SIGKILL));
    TEST_ASSERT_EQUAL_INT(process, waitpid(process, NULL, 0));
    forget();
    take_line();
}

static void ends_with(volatile unsigned *cause, const char *line) {
    static const char *const watch[] = {"watch",   "--model", "watched.json", "--report",
                                        "watched", "--for",   "1000",         NULL};
    play_what_is_watched();
    start_watch(watch);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, waitpid(process, NULL, WNOHANG), "it has ended");
    *cause = 3; /* requests later */
    const int status = end();
    TEST_ASSERT_TRUE_MESSAGE(WIFEXITED(status) && WEXITSTATUS(status) == 1, errors);
    expect_error(line);
}

/* There is nothing to watch any more. */
static void test_a_watch_ends_when_the_amplifier_restarts(void) {
    ends_with(&simulated_device_line()->restart_after, "hyst: the amplifier restarted: ");
}

static void test_a_watch_ends_when_the_amplifier_no_longer_compensates(void) {
    ends_with(&simulated_device_line()->park_after,
              "hyst: the amplifier no longer compensates: it is on, in mode park");
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_watch_whose_folder_is_gone_goes_on);
    RUN_TEST(test_a_watch_that_is_interrupted_frees_the_line_before_its_page_is_written);
    RUN_TEST(test_a_watch_that_is_killed_leaves_no_lock);
    RUN_TEST(test_a_watch_ends_when_the_amplifier_restarts);
    RUN_TEST(test_a_watch_ends_when_the_amplifier_no_longer_compensates);
    return UNITY_END();
}
