/* SPDX-License-Identifier: MIT */
/*
 * Address, rate and parity of the Modbus line: who may change them and when, that the answer still goes out as before,
 * what a start finds, and the ways back.
 */
#include "amplifier.h"
#include "fake_board.h"
#include "hyst/cost.h"
#include "loop/loop.h"
#include "master.h"
#include "random.h"
#include "store/image_store.h"
#include "store/parameter_store.h"
#include "unity.h"
#include <stdio.h>
#include <string.h>

static const board_start_t plain_start = {.reset_cause = RESET_POWER};

void setUp(void) {
    fake_store_clear();
    fake_board_start(&plain_start);
}
void tearDown(void) {
}

/* Through the bytes of the line, as a master's request comes. Returns whether it was answered. */
static bool answered(uint8_t address, const uint8_t *pdu, size_t length) {
    uint8_t frame[MODBUS_FRAME_MAX];
    const size_t frame_length = master_frame(frame, address, pdu, length);
    const unsigned before = fake_board.frames_sent;
    fake_board.microseconds += 100000;
    for (size_t i = 0; i < frame_length; i++) {
        modbus_server_receive(frame[i]);
    }
    fake_board.microseconds += 100000;
    (void)amplifier_serve();
    return fake_board.frames_sent != before;
}

static bool asked(uint8_t address) {
    const uint8_t pdu[] = {3, 0, ADDRESS_magic, 0, 1};
    return answered(address, pdu, sizeof pdu);
}

static bool commanded(uint8_t address, control_command_t command) {
    const uint8_t pdu[] = {6, ADDRESS_command >> 8, ADDRESS_command & 0xFF, 0, (uint8_t)command};
    return answered(address, pdu, sizeof pdu);
}

static void note(uint32_t address, uint32_t baud, line_parity_t parity) {
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_line_address, address));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_line_baud, baud));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_line_parity, parity));
}

static void expect_line(uint8_t address, uint32_t baud, line_parity_t parity) {
    TEST_ASSERT_EQUAL_UINT32(baud, fake_board.baud);
    TEST_ASSERT_EQUAL(parity, fake_board.parity);
    TEST_ASSERT_TRUE(asked(address));
    TEST_ASSERT_EQUAL_UINT8(address, fake_board.sent[0]);
    for (unsigned other = 1; other <= 255; other++) {
        TEST_ASSERT_TRUE(other == address || !asked((uint8_t)other));
    }
}

static void test_a_new_amplifier_has_the_default_line(void) {
    expect_line(1, 115200, LINE_PARITY_NONE);
    TEST_ASSERT_EQUAL_UINT32(1, master_get(INDEX_line_address));
    TEST_ASSERT_EQUAL_UINT32(115200, master_get(INDEX_line_baud));
    TEST_ASSERT_EQUAL_UINT32(LINE_PARITY_NONE, master_get(INDEX_line_parity));
}

static void test_it_takes_the_key_for_parameters(void) {
    fake_board_start_locked(&plain_start);
    TEST_ASSERT_EQUAL(MODBUS_DEVICE_FAILURE, master_set(INDEX_line_address, 2));
    TEST_ASSERT_EQUAL_UINT32(WRITE_PARAMETERS_LOCKED, master_get(INDEX_write_refused));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_unlock, CONTROL_KEY_OUTPUT));
    TEST_ASSERT_EQUAL(MODBUS_DEVICE_FAILURE, master_set(INDEX_line_baud, 9600));
    TEST_ASSERT_EQUAL(MODBUS_DEVICE_FAILURE, master_set(INDEX_line_parity, 1));
    TEST_ASSERT_EQUAL(MODBUS_DEVICE_FAILURE, master_set(INDEX_command, COMMAND_SAVE_LINE));
    TEST_ASSERT_EQUAL_UINT(0, fake_store.erasures);
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_unlock, CONTROL_KEY_PARAMETERS));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_line_address, 2));
}

static void test_what_no_line_can_have_is_refused(void) {
    static const struct {
        unsigned index;
        uint32_t good[2], bad[4];
    } cases[] = {{INDEX_line_address, {1, 247}, {0, 248, 255, 65535}},
                 {INDEX_line_baud, {9600, 500000}, {0, 9599, 500001, UINT32_MAX}},
                 {INDEX_line_parity, {LINE_PARITY_NONE, LINE_PARITY_ODD}, {3, 4, 255, 65535}}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        for (unsigned k = 0; k < 2; k++) {
            TEST_ASSERT_EQUAL(MODBUS_OK, master_set(cases[i].index, cases[i].good[k]));
        }
        for (unsigned k = 0; k < 4; k++) {
            TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_VALUE, master_set(cases[i].index, cases[i].bad[k]));
            TEST_ASSERT_EQUAL_UINT32(cases[i].good[1], master_get(cases[i].index));
        }
    }
}

/* 1 MHz through 17 is 58824, 2.1 % above 57600; through 26 it is 38462, 0.16 % above 38400. */
static void test_a_rate_is_one_that_the_divider_makes(void) {
    TEST_ASSERT_EQUAL_UINT32(729, line_divider(84000000, 115200));
    TEST_ASSERT_EQUAL_UINT32(0, line_divider(1000000, 57600));
    TEST_ASSERT_EQUAL_UINT32(26, line_divider(1000000, 38400));
    TEST_ASSERT_EQUAL_UINT32_MESSAGE(0, line_divider(1000000, 70000), "less than 16");
    TEST_ASSERT_EQUAL_UINT32_MESSAGE(0, line_divider(84000000, 1000), "more than 16 bits");
    TEST_ASSERT_EQUAL_UINT32(0, line_divider(84000000, 0));
    for (uint32_t baud = 9600; baud < 62500; baud += 7) {
        const double made = 1e6 / (double)(int)(1e6 / baud + 0.5);
        const bool good = made < 1.015 * baud && made > baud / 1.015;
        const bool clear = made < 1.014 * baud && made > baud / 1.014;
        TEST_ASSERT_TRUE(line_divider(1000000, baud) != 0 ? good || made <= 1.0155 * baud : !clear);
    }
}

/* The rates that adapters have. The h405's UART gets 84 MHz. Both ends together may be off by some 4 %. */
static void test_the_error_of_each_rate(void) {
    static const struct {
        uint32_t baud, divider;
        double error_percent;
    } rates[] = {{9600, 8750, 0.0},    {19200, 4375, 0.0},    {38400, 2188, -0.023}, {57600, 1458, 0.023},
                 {115200, 729, 0.023}, {230400, 365, -0.114}, {460800, 182, 0.160},  {500000, 168, 0.0}};
    for (size_t i = 0; i < sizeof rates / sizeof rates[0]; i++) {
        const double made = 84e6 / rates[i].divider;
        TEST_ASSERT_EQUAL_UINT32(rates[i].divider, line_divider(84000000, rates[i].baud));
        TEST_ASSERT_DOUBLE_WITHIN(0.001, rates[i].error_percent, 100.0 * (made / rates[i].baud - 1.0));
    }
}

/* From one byte's end to the next one's, less 24 cycles to enter and leave the interrupt, 3.2 us for a conversion, and
 * 400 to take the byte and for locks. */
static void test_what_a_rate_leaves_for_a_sample(void) {
    TEST_ASSERT_EQUAL_UINT32(14583 - 24 - 537 - 400, line_sample_budget(168000000, 115200));
    TEST_ASSERT_EQUAL_UINT32(7291 - 24 - 537 - 400, line_sample_budget(168000000, 230400));
    TEST_ASSERT_EQUAL_UINT32(3360 - 24 - 537 - 400, line_sample_budget(168000000, LINE_BAUD_MAX));
    TEST_ASSERT_EQUAL_UINT32_MESSAGE(0, line_sample_budget(1000000, 115200), "nothing is left");
    hyst_parameters_t p;
    hyst_parameters_default(&p);
    TEST_ASSERT_TRUE(hyst_cost_cycles(&p) <= line_sample_budget(168000000, LINE_BAUD_MAX));
    TEST_ASSERT_TRUE_MESSAGE(hyst_cost_cycles(&p) > line_sample_budget(168000000, 921600), "no image at all");
}

static hyst_parameters_t costly(uint32_t sections) {
    hyst_parameters_t p;
    hyst_parameters_default(&p);
    p.model_id = 70 + sections;
    p.shape_sections = sections < HYST_IIR_MAX_SECTIONS ? sections : HYST_IIR_MAX_SECTIONS;
    p.equalise_sections = sections - p.shape_sections;
    for (uint32_t i = 0; i < HYST_IIR_MAX_SECTIONS; i++) {
        p.shape[i] = p.equalise[i] = (hyst_iir_section_t){.b0 = HYST_Q28_ONE};
    }
    return p;
}

static uint32_t commit(const hyst_parameters_t *p) {
    uint32_t words[HYST_IMAGE_MAX_WORDS];
    master_write_words(ADDRESS_staging, words, hyst_parameters_encode(p, words, HYST_IMAGE_MAX_WORDS));
    master_command(COMMAND_COMMIT);
    (void)fake_board_run(3000);
    return master_get(INDEX_fault_code);
}

/* Where a sample takes longer than a byte, bytes would be lost, and so the requests that they belong to, STOP too. */
static void test_a_rate_and_an_image_fit_each_other(void) {
    uint32_t sections = 0;
    hyst_parameters_t large = costly(0);
    while (sections < 2U * HYST_IIR_MAX_SECTIONS &&
           hyst_cost_cycles(&large) <= line_sample_budget(168000000, LINE_BAUD_MAX)) {
        large = costly(++sections);
    }
    const hyst_parameters_t small = costly(sections - 1U);
    TEST_ASSERT_TRUE(hyst_cost_cycles(&large) > line_sample_budget(168000000, LINE_BAUD_MAX));
    TEST_ASSERT_EQUAL_UINT32(HYST_PARAMETERS_OK, commit(&large));
    note(1, LINE_BAUD_MAX, LINE_PARITY_NONE);
    TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_VALUE, master_set(INDEX_command, COMMAND_SAVE_LINE));
    TEST_ASSERT_EQUAL_UINT(0, fake_store.erasures);
    TEST_ASSERT_EQUAL_UINT32(HYST_PARAMETERS_OK, commit(&small));
    TEST_ASSERT_TRUE(commanded(1, COMMAND_SAVE_LINE));
    TEST_ASSERT_EQUAL_UINT32(line_sample_budget(168000000, LINE_BAUD_MAX), master_get(INDEX_cost_budget));
    TEST_ASSERT_EQUAL_UINT32(HYST_PARAMETERS_TOO_COSTLY, commit(&large));
    TEST_ASSERT_EQUAL_UINT32(small.model_id, master_get(INDEX_active_model_id));
    fake_board_start(&plain_start);
    TEST_ASSERT_EQUAL_UINT32(line_sample_budget(168000000, LINE_BAUD_MAX), master_get(INDEX_cost_budget));
}

static void test_nothing_changes_before_the_command_and_before_its_answer(void) {
    note(42, 19200, LINE_PARITY_EVEN);
    expect_line(1, 115200, LINE_PARITY_NONE);
    TEST_ASSERT_EQUAL_UINT(0, fake_store.erasures);
    TEST_ASSERT_TRUE(commanded(1, COMMAND_SAVE_LINE));
    TEST_ASSERT_EQUAL_UINT8_MESSAGE(1, fake_board.sent[0], "answered by the address that was asked");
    TEST_ASSERT_EQUAL_UINT8(6, fake_board.sent[1]);
    TEST_ASSERT_EQUAL_UINT_MESSAGE(fake_board.frames_sent, fake_board.frames_before_line, "after the answer");
    expect_line(42, 19200, LINE_PARITY_EVEN);
}

/* It would give every amplifier of the line one address. */
static void test_a_broadcast_changes_nothing(void) {
    note(7, 38400, LINE_PARITY_ODD);
    TEST_ASSERT_FALSE(commanded(0, COMMAND_SAVE_LINE));
    TEST_ASSERT_EQUAL_UINT(0, fake_store.erasures);
    expect_line(1, 115200, LINE_PARITY_NONE);
    TEST_ASSERT_EQUAL_UINT32(WRITE_BROADCAST, master_get(INDEX_write_refused));
}

static void test_a_start_has_what_was_stored(void) {
    note(42, 19200, LINE_PARITY_EVEN);
    TEST_ASSERT_TRUE(commanded(1, COMMAND_SAVE_LINE));
    fake_board_start(&plain_start);
    expect_line(42, 19200, LINE_PARITY_EVEN);
    TEST_ASSERT_TRUE(parameter_store_status().stored == STORE_NONE); /* there is no image */
    fake_board_start(&plain_start);
    expect_line(42, 19200, LINE_PARITY_EVEN);
}

/* For who has forgotten it: a button at start, and then the command, if it shall stay. */
static void test_the_board_can_ask_for_the_default(void) {
    const board_start_t button = {.reset_cause = RESET_PIN, .default_line = true};
    note(42, 19200, LINE_PARITY_EVEN);
    TEST_ASSERT_TRUE(commanded(1, COMMAND_SAVE_LINE));
    fake_board_start(&button);
    expect_line(1, 115200, LINE_PARITY_NONE);
    fake_board_start(&plain_start);
    expect_line(42, 19200, LINE_PARITY_EVEN);
    fake_board_start(&button);
    TEST_ASSERT_EQUAL_UINT32(1, master_get(INDEX_line_address));
    TEST_ASSERT_TRUE(commanded(1, COMMAND_SAVE_LINE));
    fake_board_start(&plain_start);
    expect_line(1, 115200, LINE_PARITY_NONE);
}

/* In a whole copy, what this board cannot have: as if nothing were stored. */
static void test_stored_settings_that_are_not_possible_are_not_in_force(void) {
    static const line_settings_t bad[] = {{0, 115200, 0}, {248, 115200, 0}, {1, 1200, 0}, {1, 115200, 3}};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        TEST_ASSERT_TRUE(image_store_save_line(&bad[i]));
        fake_board_start(&plain_start);
        expect_line(1, 115200, LINE_PARITY_NONE);
    }
}

static void test_what_the_flash_does_not_take_is_not_in_force(void) {
    note(42, 19200, LINE_PARITY_EVEN);
    fake_store.stuck = true;
    fake_store.stuck_word = 0;
    TEST_ASSERT_TRUE(commanded(1, COMMAND_SAVE_LINE));
    fake_store.stuck = false;
    TEST_ASSERT_EQUAL_UINT32(STORE_FAILED, master_get(INDEX_store_state));
    expect_line(1, 115200, LINE_PARITY_NONE);
    fake_board_start(&plain_start);
    expect_line(1, 115200, LINE_PARITY_NONE);
}

static void commit_default(uint32_t model_id) {
    uint32_t words[HYST_IMAGE_MAX_WORDS];
    hyst_parameters_t p;
    hyst_parameters_default(&p);
    p.model_id = model_id;
    master_write_words(ADDRESS_staging, words, hyst_parameters_encode(&p, words, HYST_IMAGE_MAX_WORDS));
    master_command(COMMAND_COMMIT);
    TEST_ASSERT_EQUAL_UINT32(HYST_PARAMETERS_OK, master_get(INDEX_fault_code));
    (void)fake_board_run(3000);
}

static void test_image_and_line_are_stored_beside_each_other(void) {
    commit_default(5);
    master_command(COMMAND_SAVE);
    TEST_ASSERT_EQUAL_UINT32(1, master_get(INDEX_store_sequence));
    note(42, 19200, LINE_PARITY_EVEN);
    TEST_ASSERT_TRUE(commanded(1, COMMAND_SAVE_LINE));
    TEST_ASSERT_EQUAL_UINT32(2, master_get(INDEX_store_sequence));
    fake_board_start(&plain_start);
    TEST_ASSERT_EQUAL_UINT32(5, master_get(INDEX_active_model_id));
    commit_default(6);
    master_command(COMMAND_SAVE);
    fake_board_start(&plain_start);
    TEST_ASSERT_EQUAL_UINT32(6, master_get(INDEX_active_model_id));
    expect_line(42, 19200, LINE_PARITY_EVEN);
}

/* To erase flash stalls the loop. */
static void test_it_is_refused_while_the_amplifier_is_on(void) {
    fake_board_power_on(0);
    note(42, 19200, LINE_PARITY_EVEN);
    TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_VALUE, master_set(INDEX_command, COMMAND_SAVE_LINE));
    TEST_ASSERT_EQUAL_UINT(0, fake_store.erasures);
    master_command(COMMAND_DISARM);
    (void)fake_board_run(3000);
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_command, COMMAND_SAVE_LINE));
}

/* 3 ms without a byte end a frame at 115200 baud, and are within three and a half characters at 9600. */
static void test_the_silence_that_ends_a_frame_is_that_of_the_rate(void) {
    const uint8_t pdu[] = {3, 0, ADDRESS_magic, 0, 1};
    uint8_t frame[MODBUS_FRAME_MAX];
    const size_t length = master_frame(frame, MASTER_SERVER, pdu, sizeof pdu);
    for (unsigned slow = 0; slow < 2; slow++) {
        if (slow != 0) {
            note(1, 9600, LINE_PARITY_NONE);
            TEST_ASSERT_TRUE(commanded(1, COMMAND_SAVE_LINE));
        }
        const unsigned before = fake_board.frames_sent;
        fake_board.microseconds += 100000;
        for (size_t i = 0; i < length; i++) {
            fake_board.microseconds += i == 4 ? 3000 : 100;
            modbus_server_receive(frame[i]);
            (void)amplifier_serve();
        }
        fake_board.microseconds += 3900;
        (void)amplifier_serve();
        TEST_ASSERT_EQUAL_UINT(before, fake_board.frames_sent);
        fake_board.microseconds += 200;
        (void)amplifier_serve();
        TEST_ASSERT_EQUAL_UINT(before + slow, fake_board.frames_sent);
    }
    TEST_ASSERT_EQUAL_UINT32(4010, line_silence_us(9600));
    TEST_ASSERT_EQUAL_UINT32(2005, line_silence_us(19200));
    TEST_ASSERT_EQUAL_UINT32(FAKE_SILENCE_US, line_silence_us(115200));
}

/* Time in ns, of which the amplifier's clock shows steps of a period, and characters of 10 bits, or 11 with parity. */
static uint64_t now_ns;

static void pass(uint64_t ns) {
    now_ns += ns;
    fake_board.microseconds = (uint32_t)(now_ns / (FAKE_SAMPLE_US * 1000U) * FAKE_SAMPLE_US);
}

/* A frame, with a pause behind its first bytes. A byte is received when its last bit is. */
static void frame_with_pause(const uint8_t *frame, size_t length, uint64_t byte_ns, size_t first, uint64_t pause_ns) {
    for (size_t i = 0; i < length; i++) {
        pass(byte_ns + (i == first ? pause_ns : 0U));
        modbus_server_receive(frame[i]);
    }
}

typedef struct {
    uint64_t byte_ns, t15_ns, t35_ns;
} times_t;

/* Modbus over serial line V1.02, 2.5.1.1: 1.5 and 3.5 characters, and above 19200 baud 750 and 1750 us. */
static times_t times_of(const line_settings_t *line) {
    const uint64_t byte_ns = (line->parity != LINE_PARITY_NONE ? 11U : 10U) * 1000000000ULL / line->baud;
    return line->baud > 19200U ? (times_t){byte_ns, 750000, 1750000}
                               : (times_t){byte_ns, byte_ns * 3U / 2U, byte_ns * 7U / 2U};
}

/* Whatever the rate, and wherever the steps of the clock lie: a pause of 1.5 characters is within a frame, and one of
 * 3.5 is between two. The main loop may be busy until both are there. */
static void test_the_pauses_of_the_standard(void) {
    static const uint32_t rates[] = {9600, 19200, 38400, 57600, 115200, 230400, 460800, 500000};
    const uint8_t pdu[] = {3, 0, ADDRESS_magic, 0, 1};
    random_t random = random_start("line_pauses", 20261126);
    uint8_t frame[MODBUS_FRAME_MAX];
    const size_t length = master_frame(frame, 1, pdu, sizeof pdu);
    for (unsigned i = 0; i < 8000; i++) {
        const line_settings_t line = {1, rates[i % 8U], i / 8U % 2U == 0 ? LINE_PARITY_NONE : LINE_PARITY_EVEN};
        const times_t times = times_of(&line);
        const bool busy = i / 16U % 2U == 0;
        char text[80];
        (void)snprintf(text, sizeof text, "%u baud, parity %u, %s", (unsigned)line.baud, (unsigned)line.parity,
                       busy ? "busy" : "not busy");
        modbus_server_init(&line);
        pass(100000000U + (uint64_t)random_between(&random, 0, FAKE_SAMPLE_US * 1000));
        unsigned before = fake_board.frames_sent;
        frame_with_pause(frame, length, times.byte_ns, 1U + i % (length - 1U), times.t15_ns);
        pass(100000000U);
        (void)amplifier_serve();
        TEST_ASSERT_EQUAL_UINT_MESSAGE(before + 1U, fake_board.frames_sent, text);

        before = fake_board.frames_sent;
        pass((uint64_t)random_between(&random, 0, FAKE_SAMPLE_US * 1000));
        frame_with_pause(frame, length, times.byte_ns, 0, 0);
        for (uint64_t part = 0; part < 8U; part++) {
            pass(times.t35_ns / 8U + (part == 0 ? times.t35_ns % 8U : 0U));
            if (!busy) {
                (void)amplifier_serve();
            }
        }
        frame_with_pause(frame, length, times.byte_ns, 0, 0);
        pass(100000000U);
        (void)amplifier_serve();
        TEST_ASSERT_EQUAL_UINT_MESSAGE(before + 2U, fake_board.frames_sent, text);
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_new_amplifier_has_the_default_line);
    RUN_TEST(test_it_takes_the_key_for_parameters);
    RUN_TEST(test_what_no_line_can_have_is_refused);
    RUN_TEST(test_a_rate_is_one_that_the_divider_makes);
    RUN_TEST(test_the_error_of_each_rate);
    RUN_TEST(test_what_a_rate_leaves_for_a_sample);
    RUN_TEST(test_a_rate_and_an_image_fit_each_other);
    RUN_TEST(test_nothing_changes_before_the_command_and_before_its_answer);
    RUN_TEST(test_a_broadcast_changes_nothing);
    RUN_TEST(test_a_start_has_what_was_stored);
    RUN_TEST(test_the_board_can_ask_for_the_default);
    RUN_TEST(test_stored_settings_that_are_not_possible_are_not_in_force);
    RUN_TEST(test_what_the_flash_does_not_take_is_not_in_force);
    RUN_TEST(test_image_and_line_are_stored_beside_each_other);
    RUN_TEST(test_it_is_refused_while_the_amplifier_is_on);
    RUN_TEST(test_the_silence_that_ends_a_frame_is_that_of_the_rate);
    RUN_TEST(test_the_pauses_of_the_standard);
    return UNITY_END();
}
