/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Several amplifiers on one line: each answers for itself and nobody else does, whatever the others do; a request to
 * all reaches all, and does what is meant for all. Masters are libmodbus, `hyst`, and mbpoll where it is installed.
 */
#include "fake_board.h"
#include "loop/telemetry.h"
#include "random.h"
#include "registers/control.h"
#include "registers/register_table.h"
#include "shared_line.h"
#include "unity.h"
#include <errno.h>
#include <modbus.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <termios.h>
#include <unistd.h>

enum { COUNT = 3, TRIES = 5 };
static const uint8_t addresses[COUNT] = {3, 7, 247};

/* For an answer that comes, and for one that does not. */
/* QUIET_MS: a machine that is busy for that long makes one burst of two frames, and both are lost. */
enum { PATIENCE_S = 20, IMPATIENCE_US = 200000, LATE_MS = 500, QUIET_MS = 400 };

static const char *port;
static modbus_t *bus;
static random_t rng;

static void open_bus(void) {
    bus = modbus_new_rtu(port, 115200, 'N', 8, 1);
    TEST_ASSERT_NOT_NULL(bus);
    TEST_ASSERT_EQUAL_INT(0, modbus_connect(bus));
}

static void close_bus(void) {
    if (bus != NULL) {
        modbus_close(bus);
        modbus_free(bus);
        bus = NULL;
    }
}

void setUp(void) {
    port = shared_line_start(addresses, COUNT);
    open_bus();
}

void tearDown(void) {
    close_bus();
    shared_line_stop();
}

static void ask(unsigned which, bool patient) {
    TEST_ASSERT_EQUAL_INT(0, modbus_set_slave(bus, addresses[which]));
    TEST_ASSERT_EQUAL_INT(
        0, modbus_set_response_timeout(bus, patient ? PATIENCE_S : 0, patient ? 0U : (uint32_t)IMPATIENCE_US));
}

/* A master that got nonsense waits until nobody talks any more. (Not before: it would drop what it has just sent.) */
static void settle(void) {
    struct pollfd look = {.fd = modbus_get_socket(bus), .events = POLLIN};
    while (poll(&look, 1, QUIET_MS) > 0) {
        (void)tcflush(look.fd, TCIFLUSH);
    }
}

static uint16_t get(unsigned which, uint16_t address) {
    uint16_t value = 0;
    ask(which, true);
    for (unsigned tries = 0; tries < TRIES; tries++) {
        if (modbus_read_registers(bus, address, 1, &value) == 1) {
            return value;
        }
        settle();
    }
    TEST_FAIL_MESSAGE(modbus_strerror(errno));
    return 0;
}

static void put(unsigned which, uint16_t address, uint16_t value) {
    ask(which, true);
    TEST_ASSERT_EQUAL_INT_MESSAGE(1, modbus_write_register(bus, address, value), modbus_strerror(errno));
}

/* A frame to address 0, which nobody answers. */
static void tell_all(uint16_t address, uint16_t value) {
    const uint8_t request[] = {
        MODBUS_BROADCAST_ADDRESS, 6, (uint8_t)(address >> 8), (uint8_t)address, (uint8_t)(value >> 8), (uint8_t)value};
    unsigned before[COUNT];
    for (unsigned i = 0; i < COUNT; i++) {
        before[i] = shared_line_node(i)->sent;
    }
    TEST_ASSERT_GREATER_THAN_INT(0, modbus_send_raw_request(bus, request, sizeof request));
    settle();
    for (unsigned i = 0; i < COUNT; i++) {
        TEST_ASSERT_EQUAL_UINT_MESSAGE(before[i], shared_line_node(i)->sent, "a broadcast was answered");
    }
}

/* Latched in all of them at one instant, read one after the other. */
static void expect_state(uint16_t state) {
    tell_all(ADDRESS_command, COMMAND_LATCH);
    for (unsigned i = 0; i < COUNT; i++) {
        TEST_ASSERT_EQUAL_UINT16(state, get(i, ADDRESS_amplifier_state));
    }
}

/* Each is written other values than the others, in random order; what is read is what this one was written. */
static void test_each_has_its_own_values(void) {
    static const uint16_t registers[] = {ADDRESS_capture_length, ADDRESS_capture_before, ADDRESS_model_error_time};
    enum { REGISTERS = sizeof registers / sizeof registers[0], ROUNDS = 300 };
    uint16_t written[COUNT][REGISTERS];
    for (unsigned i = 0; i < COUNT; i++) {
        for (unsigned k = 0; k < REGISTERS; k++) {
            written[i][k] = get(i, registers[k]);
        }
    }
    for (unsigned round = 0; round < ROUNDS; round++) {
        const unsigned i = (unsigned)random_between(&rng, 0, COUNT - 1);
        const unsigned k = (unsigned)random_between(&rng, 0, REGISTERS - 1);
        if (random_between(&rng, 0, 1) == 0) {
            written[i][k] = (uint16_t)random_between(&rng, 1, 65535);
            put(i, registers[k], written[i][k]);
        }
        const unsigned other = (unsigned)random_between(&rng, 0, COUNT - 1);
        TEST_ASSERT_EQUAL_UINT16(written[other][k], get(other, registers[k]));
    }
    for (unsigned i = 0; i < COUNT; i++) {
        TEST_ASSERT_GREATER_THAN_UINT(ROUNDS / 10, shared_line_node(i)->sent);
    }
}

static void test_nobody_answers_for_an_address_that_no_one_has(void) {
    uint16_t value;
    for (unsigned i = 0; i < COUNT; i++) {
        TEST_ASSERT_EQUAL_UINT16(REGISTERS_MAGIC, get(i, ADDRESS_magic));
    }
    TEST_ASSERT_EQUAL_INT(0, modbus_set_slave(bus, 8));
    TEST_ASSERT_EQUAL_INT(0, modbus_set_response_timeout(bus, 0, IMPATIENCE_US));
    TEST_ASSERT_EQUAL_INT(-1, modbus_read_registers(bus, ADDRESS_magic, 1, &value));
    TEST_ASSERT_EQUAL_INT(ETIMEDOUT, errno);
}

static void test_a_broadcast_stops_all_and_starts_none(void) {
    for (unsigned i = 0; i < COUNT; i++) {
        put(i, ADDRESS_mode, 1);
    }
    tell_all(ADDRESS_command, COMMAND_CONDITION);
    tell_all(ADDRESS_mode, 2);
    expect_state(AMPLIFIER_HOLD);
    for (unsigned i = 0; i < COUNT; i++) {
        TEST_ASSERT_EQUAL_UINT16(1, get(i, ADDRESS_mode));
        TEST_ASSERT_EQUAL_UINT16(WRITE_BROADCAST, get(i, ADDRESS_write_refused));
    }
    tell_all(ADDRESS_command, COMMAND_PARK);
    for (unsigned i = 0; i < COUNT; i++) {
        TEST_ASSERT_EQUAL_UINT16(0, get(i, ADDRESS_mode));
    }
    tell_all(ADDRESS_command, COMMAND_DISARM);
    expect_state(AMPLIFIER_OFF);
    for (unsigned i = 0; i < COUNT; i++) {
        put(i, ADDRESS_line_address, 9);
    }
    tell_all(ADDRESS_command, COMMAND_ARM);
    tell_all(ADDRESS_command, COMMAND_SAVE_LINE);
    expect_state(AMPLIFIER_OFF);
    for (unsigned i = 0; i < COUNT; i++) { /* each still has its own address */
        TEST_ASSERT_EQUAL_UINT16(WRITE_BROADCAST, get(i, ADDRESS_write_refused));
    }
}

/* One of them misbehaves. It gets as many requests as the others, whose answers stay right, and who hear everything. */
static void test_one_that_answers_wrongly_or_late_confuses_nobody(void) {
    static const answers_t faults[] = {ANSWERS_NOT, ANSWERS_LATE,      ANSWERS_GARBLED,
                                       ANSWERS_CUT, ANSWERS_AS_NOBODY, ANSWERS_TWICE};
    enum { BAD = 1, ROUNDS = 4 };
    shared_line_node(BAD)->delay_ms = LATE_MS;
    for (unsigned f = 0; f < sizeof faults / sizeof faults[0]; f++) {
        for (unsigned round = 0; round < ROUNDS; round++) {
            uint16_t value = 0;
            put(0, ADDRESS_capture_length, (uint16_t)(1000U + round));
            put(2, ADDRESS_capture_length, (uint16_t)(2000U + round));
            const unsigned before = shared_line_node(BAD)->sent;
            shared_line_node(BAD)->answers = faults[f];
            ask(BAD, false);
            const int got = modbus_read_registers(bus, ADDRESS_magic, 1, &value);
            TEST_ASSERT_TRUE_MESSAGE(got != 1 || value == REGISTERS_MAGIC, "a wrong answer was taken for a right one");
            TEST_ASSERT_TRUE_MESSAGE(got != 1 || faults[f] == ANSWERS_TWICE, "it did not misbehave");
            /* at once, while the late one is still to come */
            TEST_ASSERT_EQUAL_UINT16(1000U + round, get(0, ADDRESS_capture_length));
            TEST_ASSERT_EQUAL_UINT16(2000U + round, get(2, ADDRESS_capture_length));
            for (unsigned wait = 0; wait < 200 && faults[f] != ANSWERS_NOT && shared_line_node(BAD)->sent == before;
                 wait++) {
                settle(); /* until it has had its say */
            }
            shared_line_node(BAD)->answers = ANSWERS_RIGHT;
            settle();
            TEST_ASSERT_EQUAL_UINT16(REGISTERS_MAGIC, get(BAD, ADDRESS_magic));
        }
    }
    expect_state(AMPLIFIER_HOLD);
}

/* Runs a program, in turn with this one on the line. Returns its status; what it says is in `said`. */
static char said[8192];
static int run(const char *program, const char *options) {
    char command[512];
    close_bus();
    (void)snprintf(command, sizeof command, "'%s' %s 2>&1", program, options);
    // NOLINTNEXTLINE(cert-env33-c): the command is this test's own
    FILE *pipe = popen(command, "r");
    TEST_ASSERT_NOT_NULL(pipe);
    said[fread(said, 1, sizeof said - 1, pipe)] = '\0';
    const int status = pclose(pipe);
    open_bus();
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

static void test_the_host_tool_asks_the_one_that_is_meant(void) {
    char options[200];
    for (unsigned i = 0; i < COUNT; i++) {
        put(i, ADDRESS_mode, (uint16_t)(i + 1U));
    }
    for (unsigned i = 0; i < COUNT; i++) {
        (void)snprintf(options, sizeof options, "park --port %s --slave %u --timeout 20", port, addresses[i]);
        TEST_ASSERT_EQUAL_INT_MESSAGE(0, run(HYST_TOOL, options), said);
        for (unsigned k = 0; k < COUNT; k++) {
            TEST_ASSERT_EQUAL_UINT16(k <= i ? 0 : k + 1U, get(k, ADDRESS_mode));
        }
    }
    (void)snprintf(options, sizeof options, "info --port %s --slave 8 --timeout 0.2", port);
    TEST_ASSERT_NOT_EQUAL(0, run(HYST_TOOL, options));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(said, "no answer"), said);
}

/* One is late, and its answer comes while the next one has a request. */
static void test_the_host_tool_does_not_take_a_late_answer_of_another(void) {
    char options[200];
    shared_line_node(1)->delay_ms = 2500;
    shared_line_node(1)->answers = ANSWERS_LATE;
    (void)snprintf(options, sizeof options, "info --port %s --slave %u --timeout 0.3", port, addresses[1]);
    TEST_ASSERT_NOT_EQUAL(0, run(HYST_TOOL, options));
    for (unsigned i = 0; i < COUNT; i += 2) {
        (void)snprintf(options, sizeof options, "info --port %s --slave %u --timeout 20", port, addresses[i]);
        TEST_ASSERT_EQUAL_INT_MESSAGE(0, run(HYST_TOOL, options), said);
    }
}

static void test_a_foreign_master(void) {
    char options[200];
    if (run("mbpoll", "-V") == 127) {
        TEST_IGNORE_MESSAGE("no mbpoll");
    }
    for (unsigned i = 0; i < COUNT; i++) {
        put(i, ADDRESS_capture_length, (uint16_t)(100U + i));
    }
    for (unsigned i = 0; i < COUNT; i++) {
        char expected[40];
        (void)snprintf(options, sizeof options, "-m rtu -a %u -b 115200 -P none -0 -1 -o 10 -r %u -c 1 -t 4 %s",
                       addresses[i], (unsigned)ADDRESS_capture_length, port);
        TEST_ASSERT_EQUAL_INT_MESSAGE(0, run("mbpoll", options), said);
        (void)snprintf(expected, sizeof expected, "[%u]: \t%u", (unsigned)ADDRESS_capture_length, 100U + i);
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(said, expected), said);
    }
}

int main(void) {
    rng = random_start("device_shared_line", 20261125);
    UNITY_BEGIN();
    RUN_TEST(test_each_has_its_own_values);
    RUN_TEST(test_nobody_answers_for_an_address_that_no_one_has);
    RUN_TEST(test_a_broadcast_stops_all_and_starts_none);
    RUN_TEST(test_one_that_answers_wrongly_or_late_confuses_nobody);
    RUN_TEST(test_the_host_tool_asks_the_one_that_is_meant);
    RUN_TEST(test_the_host_tool_does_not_take_a_late_answer_of_another);
    RUN_TEST(test_a_foreign_master);
    return UNITY_END();
}
