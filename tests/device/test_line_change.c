/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A change of the line's settings: whatever is lost on the way, the amplifier is found, or what is said is where it can
 * be. */
#include "amplifier/device/line_change.h"
#include "amplifier/device/opening.h"
#include "base/monotonic_clock.h"
#include "client_at_line.h"
#include "loop/telemetry.h"
#include "simulated_device.h"
#include "store/parameter_store.h"
#include "unity.h"
#include <string.h>

void setUp(void) {
    client_at_line_open();
}

void tearDown(void) {
    client_at_line_close();
}

/* The simulated amplifier is on. */
static void test_the_line_is_not_changed_while_the_amplifier_is_on(void) {
    const line_settings_t wanted = {.address = 9, .baud = 19200, .parity = LINE_PARITY_ODD};
    line_settings_t held;
    TEST_ASSERT_FALSE(line_change(&options, &wanted, &failure));
    expect_line("the amplifier is on, and stores its line only while it is off");
    open_device();
    TEST_ASSERT_TRUE_MESSAGE(line_read(device, &held, &failure), failure.text);
    TEST_ASSERT_EQUAL_UINT32(1, held.address);
    TEST_ASSERT_EQUAL_UINT32(115200, held.baud);
    TEST_ASSERT_EQUAL_UINT32(LINE_PARITY_NONE, held.parity);
}

static const line_settings_t new_line = {.address = 9, .baud = 19200, .parity = LINE_PARITY_NONE};

static bool answers_at(const line_settings_t *line) {
    device_options_t there = options;
    there.slave = line->address;
    there.baud = line->baud;
    failure_t ignored;
    device_t *found = device_open(&there, &ignored);
    device_close(found);
    return found != NULL;
}

/* Off, and the line as delivered; then it gets these settings on a line with this fault. */
static bool stores_line(const line_settings_t *line, line_fault_t fault, unsigned after, unsigned times) {
    tearDown();
    setUp();
    options.timeout_s = 0.1; /* many losses, and each is waited for several times */
    open_device();
    TEST_ASSERT_TRUE_MESSAGE(device_command(device, COMMAND_DISARM, &failure), failure.text);
    for (int i = 0; i < 100 && read_register(INDEX_amplifier_state) != AMPLIFIER_OFF; i++) {
        sleep_until(monotonic_s() + 0.01);
    }
    device_close(device);
    device = NULL;
    simulated_device_fault(fault, after, times);
    failure.text[0] = '\0';
    const bool changed = line_change(&options, line, &failure);
    simulated_device_fault(LINE_GOOD, 0, 0);
    return changed;
}

static bool changes_line(line_fault_t fault, unsigned after, unsigned times) {
    return stores_line(&new_line, fault, after, times);
}

/* At another rate, at address 1 in place of another, and at an address that is not looked at. */
static void test_where_an_amplifier_answers_that_did_not(void) {
    static const line_settings_t slow = {.address = 1, .baud = 38400, .parity = LINE_PARITY_NONE};
    TEST_ASSERT_TRUE_MESSAGE(stores_line(&slow, LINE_GOOD, 0, 0), failure.text);
    refuses_to_open("reading register magic");
    TEST_ASSERT_NULL(strstr(failure.text, "--baud"));
    options.look_elsewhere = true;
    refuses_to_open("An amplifier answers with --baud 38400 --parity none --slave 1");
    options.slave = 7;
    refuses_to_open("An amplifier answers with --baud 38400 --parity none --slave 1");
    TEST_ASSERT_TRUE_MESSAGE(changes_line(LINE_GOOD, 0, 0), failure.text);
    options.look_elsewhere = true;
    refuses_to_open("at 115200 baud, parity none, nor at another rate or parity");
}

/* Requests of a change on a good line, at most; the last ones write and command. */
enum { FIRST_WRITE = 9, REQUESTS_OF_A_CHANGE = 14 };

/* Any one answer is lost, that to the command too, after which the amplifier is elsewhere: it is found. */
static void test_a_lost_answer_does_not_lose_the_amplifier(void) {
    for (unsigned after = 0; after < REQUESTS_OF_A_CHANGE; after++) {
        TEST_ASSERT_TRUE_MESSAGE(changes_line(LINE_LOSES_ANSWER, after, 1), failure.text);
        TEST_ASSERT_TRUE(answers_at(&new_line));
    }
}

/* Every try of one request is lost, or its answer: what is said is where the amplifier is. */
static void test_where_the_amplifier_is_after_a_change_that_failed(void) {
    static const line_settings_t old_line = LINE_SETTINGS_DEFAULT;
    unsigned found = 0, kept = 0;
    for (unsigned after = FIRST_WRITE; after < REQUESTS_OF_A_CHANGE; after++) {
        if (changes_line(LINE_LOSES_ANSWER, after, 3)) { /* the command's */
            TEST_ASSERT_TRUE(answers_at(&new_line));
            found++;
        } else if (answers_at(&old_line)) {
            expect_line("no answer from");
            kept++;
        } else {
            TEST_ASSERT_TRUE(answers_at(&new_line));
        }
        TEST_ASSERT_FALSE(changes_line(LINE_LOSES_REQUEST, after, 3) && answers_at(&old_line));
    }
    TEST_ASSERT_GREATER_THAN_UINT(0, found);
    TEST_ASSERT_GREATER_THAN_UINT(1, kept);
}

/* Settings that it has already are stored, too (it may have been started with its button held). When no answer
 * to the command comes, the amplifier tells whether they were. What fails then is a later request, if any, and is said
 * to be that. */
static void test_a_lost_answer_to_settings_that_it_has(void) {
    static const line_settings_t same = LINE_SETTINGS_DEFAULT;
    unsigned stored = 0, not_stored = 0;
    for (unsigned after = FIRST_WRITE; after < REQUESTS_OF_A_CHANGE; after++) {
        const bool answer_lost = stores_line(&same, LINE_LOSES_ANSWER, after, 3);
        open_device();
        const bool has = read_register(INDEX_store_state) == STORE_SAVED;
        TEST_ASSERT_TRUE(has || !answer_lost);
        TEST_ASSERT_TRUE_MESSAGE(answer_lost || !has || strstr(failure.text, "register command") == NULL, failure.text);
        TEST_ASSERT_NULL_MESSAGE(strstr(failure.text, "old settings"), failure.text);
        stored += answer_lost ? 1U : 0U;
        const bool request_lost = stores_line(&same, LINE_LOSES_REQUEST, after, 3);
        open_device();
        TEST_ASSERT_TRUE(read_register(INDEX_store_state) == STORE_SAVED || !request_lost);
        not_stored += request_lost ? 0U : 1U;
    }
    TEST_ASSERT_GREATER_THAN_UINT(0, stored);
    TEST_ASSERT_GREATER_THAN_UINT(0, not_stored);
}

/* Stored before: that is not the answer to this command. */
static void test_what_was_stored_before_is_no_answer(void) {
    static const line_settings_t same = LINE_SETTINGS_DEFAULT;
    TEST_ASSERT_TRUE_MESSAGE(stores_line(&same, LINE_GOOD, 0, 0), failure.text);
    options.timeout_s = TIMEOUT_S;
    for (unsigned after = 0; after < REQUESTS_OF_A_CHANGE; after++) {
        open_device();
        const int64_t before = read_register(INDEX_store_sequence);
        device_close(device);
        simulated_device_fault(LINE_LOSES_REQUEST, after, 3);
        const bool changed = line_change(&options, &same, &failure);
        simulated_device_fault(LINE_GOOD, 0, 0);
        open_device();
        TEST_ASSERT_TRUE(!changed || read_register(INDEX_store_sequence) != before);
        device_close(device);
        device = NULL;
    }
}

/* The line dies with the answer: both that the amplifier can have are said, and the way out. */
static void test_a_line_that_dies_with_the_answer(void) {
    unsigned nowhere = 0;
    for (unsigned after = FIRST_WRITE; after < REQUESTS_OF_A_CHANGE; after++) {
        TEST_ASSERT_FALSE(changes_line(LINE_LOSES_ANSWER, after, 1000));
        if (answers_at(&new_line)) {
            expect_line("The amplifier has address 1, 115200 baud, parity none, or address 9, 19200 baud, parity none");
            expect_line("start it with its button held");
            nowhere++;
        }
    }
    TEST_ASSERT_GREATER_THAN_UINT(0, nowhere);
}

static void test_a_parity_that_is_none(void) {
    options.parity = "mark";
    TEST_ASSERT_FALSE(device_options_check(&options, &failure));
    expect_line("--parity mark: not none, even or odd");
    options.parity = "";
    TEST_ASSERT_FALSE(device_options_check(&options, &failure));
    for (int parity = LINE_PARITY_NONE; parity <= LINE_PARITY_ODD; parity++) {
        options.parity = parity_name(parity);
        TEST_ASSERT_TRUE(device_options_check(&options, &failure));
        TEST_ASSERT_EQUAL_INT(parity, parity_number(options.parity));
    }
    TEST_ASSERT_EQUAL_STRING("unknown", parity_name(LINE_PARITY_ODD + 1));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_the_line_is_not_changed_while_the_amplifier_is_on);
    RUN_TEST(test_where_an_amplifier_answers_that_did_not);
    RUN_TEST(test_a_lost_answer_does_not_lose_the_amplifier);
    RUN_TEST(test_where_the_amplifier_is_after_a_change_that_failed);
    RUN_TEST(test_a_lost_answer_to_settings_that_it_has);
    RUN_TEST(test_what_was_stored_before_is_no_answer);
    RUN_TEST(test_a_line_that_dies_with_the_answer);
    RUN_TEST(test_a_parity_that_is_none);
    return UNITY_END();
}
