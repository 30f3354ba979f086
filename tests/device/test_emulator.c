/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The terminal of the bench is its emulator's: one that belongs to somebody else is not touched. */
#include "bench/emulator.h"
#include "unity.h"
#include <fcntl.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <termios.h>
#include <unistd.h>

/* Stands in for the emulator: names a terminal that this process has, as a reused one would be. */
static char program[] = "named-terminal-XXXXXX";
static int master, terminal;
static struct termios before;

static void write_program(const char *then) {
    memcpy(strrchr(program, '-'), "-XXXXXX", sizeof "-XXXXXX");
    const int file = mkstemp(program);
    FILE *script = fdopen(file, "w");
    TEST_ASSERT_NOT_NULL(script);
    (void)fprintf(script, "#!/bin/sh\necho \"char device redirected to %s (label serial0)\"\n%s\n", ptsname(master),
                  then);
    TEST_ASSERT_EQUAL_INT(0, fchmod(file, S_IRWXU));
    TEST_ASSERT_EQUAL_INT(0, fclose(script));
}

void setUp(void) {
    master = posix_openpt(O_RDWR | O_NOCTTY);
    TEST_ASSERT_TRUE(master >= 0 && grantpt(master) == 0 && unlockpt(master) == 0);
    (void)fcntl(master, F_SETFD, FD_CLOEXEC); /* or the program would hold it as well */
    terminal = open(ptsname(master), O_RDWR | O_NOCTTY | O_CLOEXEC);
    TEST_ASSERT_TRUE(terminal >= 0);
    TEST_ASSERT_EQUAL_INT(0, tcgetattr(terminal, &before));
}

void tearDown(void) {
    (void)unlink(program);
    (void)close(terminal);
    (void)close(master);
}

static void is_left_alone(const char *then) {
    emulator_t emulator;
    failure_t failure = {""};
    char path[64];
    write_program(then);
    (void)snprintf(path, sizeof path, "./%s", program);
    TEST_ASSERT_FALSE(emulator_start(&emulator, path, program, &failure));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(failure.text, "is not the emulator's pseudo-terminal"), failure.text);
    struct termios after;
    TEST_ASSERT_EQUAL_INT(0, tcgetattr(terminal, &after));
    TEST_ASSERT_EQUAL_HEX32(before.c_iflag, after.c_iflag);
    TEST_ASSERT_EQUAL_HEX32(before.c_oflag, after.c_oflag);
    TEST_ASSERT_EQUAL_HEX32(before.c_lflag, after.c_lflag);
    struct pollfd shown = {.fd = master, .events = POLLIN};
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, poll(&shown, 1, 0), "something was written to it");
}

static void test_an_emulator_that_has_ended_has_no_terminal(void) {
    is_left_alone("exit 0");
}

static void test_a_terminal_of_another_process_is_left_alone(void) {
    is_left_alone("exec sleep 100");
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_an_emulator_that_has_ended_has_no_terminal);
    RUN_TEST(test_a_terminal_of_another_process_is_left_alone);
    return UNITY_END();
}
