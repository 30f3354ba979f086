/* SPDX-License-Identifier: MIT */
/*
 * What a request to every amplifier of the line can do: what makes the output safe or harms nothing, and not a bit
 * more, with everything unlocked. That a register or a command is refused for being broadcast shows in that the same
 * request is taken when it goes to one amplifier.
 */
#include "amplifier.h"
#include "fake_board.h"
#include "loop/loop.h"
#include "master.h"
#include "store/parameter_store.h"
#include "unity.h"
#include <string.h>

#define BYTES(...) (const uint8_t[]){__VA_ARGS__}, sizeof((const uint8_t[]){__VA_ARGS__})

void setUp(void) {
    fake_board_power_on(0);
}
void tearDown(void) {
}

/* Returns whether it was executed. */
static bool broadcast(const uint8_t *pdu, size_t length) {
    uint8_t frame[MODBUS_FRAME_MAX], reply[MODBUS_FRAME_MAX];
    size_t reply_length = 99;
    const size_t frame_length = master_frame(frame, MODBUS_BROADCAST_ADDRESS, pdu, length);
    const modbus_outcome_t outcome = modbus_serve(frame, frame_length, reply, &reply_length);
    TEST_ASSERT_EQUAL_UINT_MESSAGE(0, reply_length, "a broadcast is not answered");
    TEST_ASSERT_TRUE(outcome == MODBUS_FRAME_BROADCAST || outcome == MODBUS_FRAME_REFUSED);
    return outcome == MODBUS_FRAME_BROADCAST;
}

/* By function 16, a value of one register or two. */
static bool broadcast_value(uint16_t address, unsigned size, uint32_t value) {
    const uint8_t pdu[] = {16,
                           (uint8_t)(address >> 8),
                           (uint8_t)address,
                           0,
                           (uint8_t)size,
                           (uint8_t)(2U * size),
                           (uint8_t)(value >> (size == 1 ? 8 : 24)),
                           (uint8_t)(value >> (size == 1 ? 0 : 16)),
                           (uint8_t)(value >> 8),
                           (uint8_t)value};
    return broadcast(pdu, 6U + 2U * size);
}

static bool broadcast_command(unsigned command) {
    return broadcast_value(ADDRESS_command, 1, command);
}

static void expect_refused_as_broadcast(uint16_t address, const char *what) {
    TEST_ASSERT_EQUAL_UINT32_MESSAGE(WRITE_BROADCAST, master_get(INDEX_write_refused), what);
    TEST_ASSERT_EQUAL_HEX16_MESSAGE(address, master_get(INDEX_write_refused_at), what);
}

/* A value that one amplifier would take, and that is not there now. */
static uint32_t another(unsigned index) {
    const uint32_t before = master_get(index);
    const uint32_t values[] = {1, 2, 3, 4, 7, 100, 9600, UINT32_MAX, 0, before + 1U, before - 1U};
    for (size_t i = 0; i < sizeof values / sizeof values[0]; i++) {
        setUp();
        if (values[i] != before && master_set(index, values[i]) == MODBUS_OK && master_get(index) == values[i]) {
            setUp();
            return values[i];
        }
    }
    TEST_FAIL_MESSAGE(register_table[index].name);
    return 0;
}

static void test_no_setting_takes_a_broadcast(void) {
    unsigned tried = 0;
    for (unsigned i = 0; i < REGISTER_COUNT; i++) {
        const register_info_t *info = &register_table[i];
        if (info->access != REGISTER_RW) {
            continue;
        }
        const uint32_t value = another(i), before = master_get(i);
        TEST_ASSERT_FALSE_MESSAGE(broadcast_value(info->address, REGISTER_SIZE(info->type), value), info->name);
        expect_refused_as_broadcast(info->address, info->name);
        TEST_ASSERT_EQUAL_UINT32_MESSAGE(before, master_get(i), info->name);
        TEST_ASSERT_EQUAL_MESSAGE(MODBUS_OK, master_set(i, value), info->name);
        tried++;
    }
    TEST_ASSERT_GREATER_THAN_UINT(30, tried);
}

static void test_no_block_takes_a_broadcast(void) {
    static const uint16_t blocks[] = {ADDRESS_tones, ADDRESS_waveform, ADDRESS_staging};
    static const uint16_t values[] = {0, 1};
    for (size_t i = 0; i < sizeof blocks / sizeof blocks[0]; i++) {
        uint16_t read[2];
        TEST_ASSERT_FALSE(broadcast_value(blocks[i], 2, 1));
        expect_refused_as_broadcast(blocks[i], "block");
        TEST_ASSERT_EQUAL(MODBUS_OK, master_read(blocks[i], 2, read));
        TEST_ASSERT_EQUAL_UINT16(0, read[1]);
        TEST_ASSERT_EQUAL(MODBUS_OK, master_write(blocks[i], 2, values));
    }
}

/* Each of these is possible here, and is shown to be by asking one amplifier. */
static void off_with_an_image(void) {
    setUp();
    master_command(COMMAND_DISARM);
    (void)fake_board_run(3000);
    TEST_ASSERT_TRUE(loop_off());
}

static void ready_to_start(void) {
    setUp();
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_source, 1));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_source_amplitude, 1U << 28));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_source_increment, 1U << 20));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_mode, HYST_MODE_DIRECT));
}

static void image_staged(void) {
    uint32_t words[HYST_IMAGE_MAX_WORDS];
    hyst_parameters_t p;
    setUp();
    hyst_parameters_default(&p);
    p.model_id = 77;
    master_write_words(ADDRESS_staging, words, hyst_parameters_encode(&p, words, HYST_IMAGE_MAX_WORDS));
}

static void test_no_command_that_starts_or_changes_takes_a_broadcast(void) {
    static const struct {
        control_command_t command;
        void (*prepare)(void);
        const char *name;
    } cases[] = {
        {COMMAND_COMMIT, image_staged, "commit"},    {COMMAND_START, ready_to_start, "start"},
        {COMMAND_CONDITION, setUp, "condition"},     {COMMAND_ARM_CAPTURE, setUp, "arm capture"},
        {COMMAND_ARM, off_with_an_image, "arm"},     {COMMAND_SAVE, off_with_an_image, "save"},
        {COMMAND_END_CAPTURE, setUp, "end capture"}, {COMMAND_SAVE_LINE, off_with_an_image, "save line"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        cases[i].prepare();
        const uint32_t state = master_get(INDEX_amplifier_state), commits = master_get(INDEX_commits);
        const uint32_t events = master_get(INDEX_events), capture = master_get(INDEX_capture_state);
        TEST_ASSERT_FALSE_MESSAGE(broadcast_command(cases[i].command), cases[i].name);
        expect_refused_as_broadcast(ADDRESS_command, cases[i].name);
        (void)fake_board_run(10);
        TEST_ASSERT_EQUAL_UINT32_MESSAGE(state, master_get(INDEX_amplifier_state), cases[i].name);
        TEST_ASSERT_EQUAL_UINT32_MESSAGE(commits, master_get(INDEX_commits), cases[i].name);
        TEST_ASSERT_EQUAL_UINT32_MESSAGE(events, master_get(INDEX_events), cases[i].name);
        TEST_ASSERT_EQUAL_UINT32_MESSAGE(capture, master_get(INDEX_capture_state), cases[i].name);
        TEST_ASSERT_EQUAL_UINT_MESSAGE(0, fake_store.erasures, cases[i].name);
        TEST_ASSERT_EQUAL_MESSAGE(MODBUS_OK, master_set(INDEX_command, cases[i].command), cases[i].name);
    }
}

static void playing(void) {
    ready_to_start();
    master_command(COMMAND_START);
    (void)fake_board_run(2000);
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_RUN, master_get(INDEX_amplifier_state));
}

static void test_what_makes_the_output_safe_does(void) {
    playing();
    TEST_ASSERT_TRUE(broadcast_command(COMMAND_STOP));
    (void)fake_board_run(2);
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_HOLD, master_get(INDEX_amplifier_state));
    playing();
    TEST_ASSERT_TRUE(broadcast_command(COMMAND_PARK));
    TEST_ASSERT_EQUAL_INT32(0, fake_board_run(3000));
    playing();
    TEST_ASSERT_TRUE(broadcast(BYTES(6, ADDRESS_mode >> 8, ADDRESS_mode & 0xFF, 0, HYST_MODE_PARK)));
    TEST_ASSERT_EQUAL_INT32(0, fake_board_run(3000));
    playing();
    TEST_ASSERT_TRUE(broadcast_command(COMMAND_DISARM));
    (void)fake_board_run(3000);
    TEST_ASSERT_TRUE(loop_off());
    TEST_ASSERT_FALSE(fake_board.stage_enabled);
}

static void test_stop_leads_out_of_a_fault_and_no_farther(void) {
    (void)loop_sample(&(loop_input_t){.faults = FAULT_SUPPLY, .position_code = BOARD_CODE_MIDDLE});
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_FAULT, master_get(INDEX_amplifier_state));
    TEST_ASSERT_TRUE(broadcast_command(COMMAND_DISARM));
    (void)fake_board_run(3000);
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_FAULT, master_get(INDEX_amplifier_state));
    TEST_ASSERT_TRUE(broadcast_command(COMMAND_STOP));
    (void)fake_board_run(3000);
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_OFF, master_get(INDEX_amplifier_state));
    TEST_ASSERT_FALSE(fake_board.stage_enabled);
}

/* Latched at one instant, read one after the other. */
static void test_latch_is_of_the_instant_of_the_broadcast(void) {
    uint16_t values[2];
    TEST_ASSERT_TRUE(broadcast_command(COMMAND_LATCH));
    const uint32_t then = loop_samples();
    (void)fake_board_run(500);
    TEST_ASSERT_EQUAL(MODBUS_OK, master_read(ADDRESS_samples, 2, values));
    const uint32_t samples = (uint32_t)values[0] << 16 | values[1];
    TEST_ASSERT_TRUE(samples <= then);
    TEST_ASSERT_TRUE(broadcast_command(COMMAND_NONE));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_read(ADDRESS_samples, 2, values));
    TEST_ASSERT_EQUAL_UINT32(samples, (uint32_t)values[0] << 16 | values[1]);
    TEST_ASSERT_TRUE(broadcast_command(COMMAND_LATCH));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_read(ADDRESS_samples, 2, values));
    TEST_ASSERT_EQUAL_UINT32(samples + 500U, (uint32_t)values[0] << 16 | values[1]);
}

static void test_clear_needs_its_key_and_a_lock_needs_none(void) {
    (void)loop_sample(&(loop_input_t){.faults = FAULT_OVERRUN, .position_code = BOARD_CODE_MIDDLE});
    TEST_ASSERT_EQUAL_UINT32(1, master_get(INDEX_overruns));
    TEST_ASSERT_TRUE(broadcast_command(COMMAND_CLEAR));
    TEST_ASSERT_EQUAL_UINT32(0, master_get(INDEX_overruns));
    TEST_ASSERT_TRUE(broadcast_value(ADDRESS_unlock, 1, 0));
    TEST_ASSERT_EQUAL_UINT32(0, master_get(INDEX_unlocked));
    TEST_ASSERT_FALSE(broadcast_command(COMMAND_CLEAR));
    TEST_ASSERT_EQUAL_UINT32(WRITE_PARAMETERS_LOCKED, master_get(INDEX_write_refused));
    TEST_ASSERT_TRUE(broadcast_command(COMMAND_DISARM));
}

/* For being broadcast, even where the amplifier could not do it now, or never. */
static void test_what_may_not_be_broadcast_is_refused_for_that(void) {
    static const unsigned commands[] = {COMMAND_START, COMMAND_CONDITION, COMMAND_ARM, COMMAND_SAVE, 77};
    const board_start_t start = {.reset_cause = RESET_POWER};
    fake_store_clear();
    fake_board_start(&start); /* off, and without an image */
    for (size_t i = 0; i < sizeof commands / sizeof commands[0]; i++) {
        TEST_ASSERT_FALSE(broadcast_command(commands[i]));
        expect_refused_as_broadcast(ADDRESS_command, "command");
    }
    TEST_ASSERT_FALSE(broadcast_value(ADDRESS_mode, 1, HYST_MODE_DIRECT));
    expect_refused_as_broadcast(ADDRESS_mode, "mode");
    TEST_ASSERT_FALSE(broadcast(BYTES(5, 0, 0, 0xFF, 0)));
    expect_refused_as_broadcast(ADDRESS_command, "coil");
}

static void test_no_key_is_taken_from_a_broadcast(void) {
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_unlock, 0));
    TEST_ASSERT_FALSE(broadcast_value(ADDRESS_unlock, 1, CONTROL_KEY_PARAMETERS));
    TEST_ASSERT_FALSE(broadcast_value(ADDRESS_unlock, 1, CONTROL_KEY_OUTPUT));
    TEST_ASSERT_EQUAL_UINT32(0, master_get(INDEX_unlocked));
    expect_refused_as_broadcast(ADDRESS_unlock, "unlock");
}

/* Functions 5, 15 and 22 are other ways to the same registers. */
static void test_every_function_that_writes_has_the_same_rule(void) {
    off_with_an_image();
    TEST_ASSERT_FALSE(broadcast(BYTES(5, 0, 0, 0xFF, 0)));
    TEST_ASSERT_FALSE(broadcast(BYTES(15, 0, 0, 0, 1, 1, 1)));
    TEST_ASSERT_FALSE(broadcast(BYTES(6, ADDRESS_command >> 8, ADDRESS_command & 0xFF, 0, COMMAND_ARM)));
    TEST_ASSERT_FALSE(
        broadcast(BYTES(22, ADDRESS_capture_decimation >> 8, ADDRESS_capture_decimation & 0xFF, 0, 0, 0, 9)));
    expect_refused_as_broadcast(ADDRESS_capture_decimation, "mask write");
    (void)fake_board_run(10);
    TEST_ASSERT_TRUE(loop_off());
    setUp();
    TEST_ASSERT_TRUE(broadcast(BYTES(5, 0, 0, 0, 0)));
    (void)fake_board_run(10);
    TEST_ASSERT_TRUE(loop_off());
    setUp();
    TEST_ASSERT_TRUE(broadcast(BYTES(15, 0, 0, 0, 1, 1, 0)));
    (void)fake_board_run(10);
    TEST_ASSERT_TRUE(loop_off());
}

static void test_a_broadcast_is_refused_as_a_whole(void) {
    playing();
    /* park and mode are allowed, the setpoint behind them is not */
    TEST_ASSERT_FALSE(
        broadcast(BYTES(16, ADDRESS_command >> 8, ADDRESS_command & 0xFF, 0, 4, 8, 0, COMMAND_PARK, 0, 0, 0, 0, 0, 0)));
    expect_refused_as_broadcast(ADDRESS_setpoint, "a whole request");
    (void)fake_board_run(2);
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_RUN, master_get(INDEX_amplifier_state));
    TEST_ASSERT_EQUAL_UINT32(HYST_MODE_DIRECT, master_get(INDEX_mode));
}

/* A master that is refused by all does not count as one that is there. */
static void test_a_refused_broadcast_does_not_feed_the_communication_timeout(void) {
    uint8_t frame[MODBUS_FRAME_MAX];
    for (unsigned taken = 0; taken < 2; taken++) {
        const uint8_t pdu[] = {6, ADDRESS_command >> 8, ADDRESS_command & 0xFF, 0,
                               taken != 0 ? COMMAND_LATCH : COMMAND_COMMIT};
        playing();
        TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_watchdog, 100));
        const size_t length = master_frame(frame, MODBUS_BROADCAST_ADDRESS, pdu, sizeof pdu);
        for (unsigned i = 0; i < 40; i++) {
            for (size_t byte = 0; byte < length; byte++) {
                modbus_server_receive(frame[byte]);
            }
            (void)fake_board_run(50);
            (void)amplifier_serve();
        }
        TEST_ASSERT_EQUAL_UINT32(taken != 0 ? AMPLIFIER_RUN : AMPLIFIER_FAULT, master_get(INDEX_amplifier_state));
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_no_setting_takes_a_broadcast);
    RUN_TEST(test_no_block_takes_a_broadcast);
    RUN_TEST(test_no_command_that_starts_or_changes_takes_a_broadcast);
    RUN_TEST(test_what_makes_the_output_safe_does);
    RUN_TEST(test_stop_leads_out_of_a_fault_and_no_farther);
    RUN_TEST(test_latch_is_of_the_instant_of_the_broadcast);
    RUN_TEST(test_clear_needs_its_key_and_a_lock_needs_none);
    RUN_TEST(test_what_may_not_be_broadcast_is_refused_for_that);
    RUN_TEST(test_no_key_is_taken_from_a_broadcast);
    RUN_TEST(test_every_function_that_writes_has_the_same_rule);
    RUN_TEST(test_a_broadcast_is_refused_as_a_whole);
    RUN_TEST(test_a_refused_broadcast_does_not_feed_the_communication_timeout);
    return UNITY_END();
}
