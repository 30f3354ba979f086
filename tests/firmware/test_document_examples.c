/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * The examples of docs/REGISTERS.md, run as a newcomer would: line by line, through a shell, with mbpoll, against the
 * amplifier on a pseudo-terminal. Skipped without mbpoll.
 */
#include "fake_board.h"
#include "loop/loop.h"
#include "registers/register_table.h"
#include "simulated_device.h"
#include "unity.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define SKIPPED 77

void setUp(void) {
    TEST_ASSERT_EQUAL_INT(0, setenv("LINE", simulated_device_start(NULL), 1));
}
void tearDown(void) {
    simulated_device_stop();
}

/* Runs a command; the test fails unless it succeeds. Returns the value that it printed for a register, else -1. */
static long run(const char *command, int wanted) {
    char line[256];
    long value = -1;
    // NOLINTNEXTLINE(cert-env33-c): the shell is what is to be tested, and the text is the project's own
    FILE *output = popen(command, "r");
    TEST_ASSERT_NOT_NULL(output);
    while (fgets(line, sizeof line, output) != NULL) {
        const char *end = strstr(line, "]:");
        if (line[0] == '[' && end != NULL && strtol(line + 1, NULL, 10) == wanted) {
            value = strtol(end + 2, NULL, 0);
        }
    }
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, pclose(output), command);
    return value;
}

static long read_register(int address) {
    char command[160];
    (void)snprintf(command, sizeof command, "mbpoll -m rtu -a 1 -b 115200 -P none -0 -1 -r %d -t 4 $LINE", address);
    return run(command, address);
}

static void test_every_example_does_what_it_says(void) {
    static const char indent[] = "    mbpoll";
    FILE *page = fopen(REGISTERS_PAGE, "r");
    char line[1024];
    unsigned examples = 0;
    TEST_ASSERT_NOT_NULL_MESSAGE(page, REGISTERS_PAGE);
    while (fgets(line, sizeof line, page) != NULL) {
        if (strncmp(line, indent, strlen(indent)) != 0) {
            continue;
        }
        examples++;
        const long magic = run(line, ADDRESS_magic);
        TEST_ASSERT_EQUAL_INT(examples == 1 ? (long)REGISTERS_MAGIC : -1L, magic);
    }
    TEST_ASSERT_EQUAL_INT(0, fclose(page));
    TEST_ASSERT_EQUAL_UINT_MESSAGE(15, examples, "examples on the page");

    TEST_ASSERT_EQUAL_INT(HYST_MODE_LINEAR, read_register(ADDRESS_mode));
    TEST_ASSERT_EQUAL_INT(SOURCE_SINE, read_register(ADDRESS_source));
    TEST_ASSERT_EQUAL_INT(214748365 >> 16, read_register(ADDRESS_source_amplitude));
    (void)read_register(ADDRESS_sequence);
    TEST_ASSERT_EQUAL_INT(LOOP_PLAYING, read_register(ADDRESS_state));
    TEST_ASSERT_EQUAL_INT_MESSAGE(HYST_PARAMETERS_OK, read_register(ADDRESS_fault_code), "the example's image");
    TEST_ASSERT_EQUAL_INT(FAKE_COMMITS + 1, read_register(ADDRESS_commits));
}

int main(void) {
    // NOLINTNEXTLINE(cert-env33-c): as above
    if (system("command -v mbpoll > /dev/null") != 0) {
        (void)puts("skipped: mbpoll is not installed");
        return SKIPPED;
    }
    UNITY_BEGIN();
    RUN_TEST(test_every_example_does_what_it_says);
    return UNITY_END();
}
