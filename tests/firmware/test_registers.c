/* SPDX-License-Identifier: MIT */
/* The register map: the table's own order, access, whole requests, values and their ranges. */
#include "fake_board.h"
#include "loop/loop.h"
#include "master.h"
#include "registers/registers.h"
#include "unity.h"
#include <string.h>

void setUp(void) {
    fake_board_power_on(0);
}
void tearDown(void) {
}

static void test_the_table_is_in_order_and_nothing_overlaps(void) {
    uint32_t end = 0;
    for (size_t i = 0; i < REGISTER_COUNT; i++) {
        const register_info_t *info = &register_table[i];
        TEST_ASSERT_TRUE_MESSAGE(info->address >= end, info->name);
        end = info->address + REGISTER_SIZE(info->type);
        TEST_ASSERT_EQUAL_PTR(info, register_find(info->name));
        TEST_ASSERT_NULL_MESSAGE(register_find_block(info->name), info->name);
    }
    for (size_t i = 0; i < register_block_count; i++) {
        const register_block_info_t *block = &register_blocks[i];
        TEST_ASSERT_TRUE_MESSAGE(block->address >= end, block->name);
        end = (uint32_t)block->address + block->registers;
        TEST_ASSERT_EQUAL_PTR(block, register_find_block(block->name));
    }
    TEST_ASSERT_TRUE(end <= 0x10000U);
    TEST_ASSERT_NULL(register_find("no such register"));
}

/* Every address of the map, one by one, against the table. */
static void test_exactly_the_registers_of_the_table_can_be_read(void) {
    for (uint32_t address = 0; address < 0x10000U; address++) {
        bool expected = false;
        for (size_t i = 0; i < REGISTER_COUNT; i++) {
            const register_info_t *info = &register_table[i];
            expected = expected || (address >= info->address && address < info->address + REGISTER_SIZE(info->type));
        }
        for (size_t i = 0; i < register_block_count; i++) {
            const register_block_info_t *block = &register_blocks[i];
            expected = expected || (address >= block->address && address - block->address < block->registers);
        }
        TEST_ASSERT_EQUAL_MESSAGE(expected ? MODBUS_OK : MODBUS_ILLEGAL_ADDRESS,
                                  registers_check_read((uint16_t)address, 1), "check");
    }
}

static void test_identity(void) {
    TEST_ASSERT_EQUAL_HEX32(REGISTERS_MAGIC, master_get(INDEX_magic));
    TEST_ASSERT_EQUAL_UINT32(4, master_get(INDEX_abi));
    TEST_ASSERT_EQUAL_UINT32(board_info.sample_rate_mhz, master_get(INDEX_sample_rate));
    TEST_ASSERT_EQUAL_UINT32(FAKE_LATENCY, master_get(INDEX_latency));
    TEST_ASSERT_EQUAL_UINT32(LENGTH_capture / 3, master_get(INDEX_capture_capacity));
    TEST_ASSERT_EQUAL_UINT32(LENGTH_waveform / 4, master_get(INDEX_waveform_capacity));
}

static void test_writable_registers_keep_what_is_written(void) {
    for (unsigned i = 0; i < REGISTER_COUNT; i++) {
        if (register_table[i].access == REGISTER_RW) {
            const uint32_t value = master_value_in_range(i);
            TEST_ASSERT_EQUAL_MESSAGE(MODBUS_OK, master_set(i, value), register_table[i].name);
            TEST_ASSERT_EQUAL_UINT32_MESSAGE(value, master_get(i), register_table[i].name);
        }
    }
}

static void test_read_only_registers_refuse(void) {
    for (unsigned i = 0; i < REGISTER_COUNT; i++) {
        if (register_table[i].access == REGISTER_RO) {
            TEST_ASSERT_EQUAL_MESSAGE(MODBUS_ILLEGAL_ADDRESS, master_set(i, 1), register_table[i].name);
        }
    }
    const uint16_t value = 1;
    TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_ADDRESS, master_write(ADDRESS_active, 1, &value));
    TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_ADDRESS, master_write(ADDRESS_capture, 1, &value));
}

static void test_the_command_reads_as_0(void) {
    master_command(COMMAND_CLEAR);
    TEST_ASSERT_EQUAL_UINT32(0, master_get(INDEX_command));
}

static void test_values_out_of_range(void) {
    static const struct {
        unsigned index;
        uint32_t good, bad;
    } cases[] = {{INDEX_mode, 3, 4},
                 {INDEX_source, 4, 5},
                 {INDEX_sweep_spacing, 1, 2},
                 {INDEX_source_tones, 16, 17},
                 {INDEX_command, COMMAND_LATCH, COMMAND_END_CAPTURE + 1},
                 {INDEX_waveform_points, LENGTH_waveform / 4, LENGTH_waveform / 4 + 1},
                 {INDEX_capture_decimation, 1, 0},
                 {INDEX_capture_decimation, 65535, 0},
                 {INDEX_capture_trigger, 4, 5},
                 {INDEX_setpoint_slew, 1, 0},
                 {INDEX_reference_slew, INT32_MAX, 0x80000000U},
                 {INDEX_drive_slew, FAKE_DRIVE_SLEW_MAX, FAKE_DRIVE_SLEW_MAX + 1},
                 {INDEX_drive_slew, FAKE_FAULT_SLEW_MIN, FAKE_FAULT_SLEW_MIN - 1},
                 {INDEX_health_looks, 100, 0},
                 {INDEX_setpoint_slew, INT32_MAX, 0x80000000U}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        const char *name = register_table[cases[i].index].name;
        TEST_ASSERT_EQUAL_MESSAGE(MODBUS_OK, master_set(cases[i].index, cases[i].good), name);
        TEST_ASSERT_EQUAL_MESSAGE(MODBUS_ILLEGAL_VALUE, master_set(cases[i].index, cases[i].bad), name);
        if (cases[i].index != INDEX_command) {
            TEST_ASSERT_EQUAL_UINT32_MESSAGE(cases[i].good, master_get(cases[i].index), name);
        }
    }
}

static void expect_refusal(uint32_t why, uint16_t address) {
    TEST_ASSERT_EQUAL_UINT32(why, master_get(INDEX_write_refused));
    TEST_ASSERT_EQUAL_HEX16(address, master_get(INDEX_write_refused_at));
}

/* A rejected write says why, and at which register, until the next one. */
static void test_why_a_write_was_refused(void) {
    const uint16_t values[] = {0, 0, 0, 0};
    expect_refusal(0, 0);
    TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_ADDRESS, master_write(0x00F0, 1, values));
    expect_refusal(1, 0x00F0);
    TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_ADDRESS, master_write(ADDRESS_magic, 1, values));
    expect_refusal(2, ADDRESS_magic);
    TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_ADDRESS, master_write(ADDRESS_mode, 2, values));
    expect_refusal(3, ADDRESS_setpoint);
    TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_VALUE, master_set(INDEX_capture_decimation, 0));
    expect_refusal(4, ADDRESS_capture_decimation);
    TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_VALUE, master_set(INDEX_command, 99));
    expect_refusal(5, ADDRESS_command);
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_capture_length, 1));
    expect_refusal(5, ADDRESS_command);
    TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_ADDRESS, master_write(ADDRESS_active + 3, 1, values));
    expect_refusal(2, ADDRESS_active + 3);
}

static void test_a_two_register_value_is_written_only_whole(void) {
    const uint16_t values[] = {1, 2, 3, 4};
    TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_ADDRESS, master_write(ADDRESS_setpoint, 1, values));
    TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_ADDRESS, master_write(ADDRESS_setpoint + 1, 1, values));
    TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_ADDRESS, master_write(ADDRESS_setpoint + 1, 2, values)); /* half, and source */
    TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_ADDRESS, master_write(ADDRESS_mode, 2, values)); /* mode and half a setpoint */
    TEST_ASSERT_EQUAL_UINT32(0, master_get(INDEX_mode));
    TEST_ASSERT_EQUAL_UINT32(0, master_get(INDEX_setpoint));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_write(ADDRESS_mode, 3, values));
    TEST_ASSERT_EQUAL_HEX32(0x00020003, master_get(INDEX_setpoint));
}

/* The whole control block in one request, one bad value at a time, at each place: nothing of it may stick. */
static void test_a_request_with_one_bad_value_changes_nothing(void) {
    enum { FIRST = ADDRESS_command, COUNT = ADDRESS_source_tones + 1 - ADDRESS_command };
    uint16_t good[COUNT + 1] = {0};
    uint16_t before[COUNT], after[COUNT];
    good[ADDRESS_mode - FIRST] = HYST_MODE_LINEAR;
    good[ADDRESS_setpoint - FIRST] = 0x1000;
    good[ADDRESS_source - FIRST] = SOURCE_SINE;
    good[ADDRESS_source_increment - FIRST] = 0x0100;
    good[ADDRESS_waveform_points - FIRST] = 5;
    good[ADDRESS_capture_decimation - FIRST] = 7;
    good[ADDRESS_capture_length - FIRST] = 100;
    good[ADDRESS_setpoint_slew - FIRST] = 0x0200;
    good[ADDRESS_capture_signals - FIRST] = 1;
    TEST_ASSERT_EQUAL(MODBUS_OK, master_read(FIRST, COUNT, before));
    static const struct {
        uint16_t address, bad;
    } faults[] = {{ADDRESS_command, 99},        {ADDRESS_mode, 4},
                  {ADDRESS_source, 5},          {ADDRESS_waveform_points, 999},
                  {ADDRESS_capture_signals, 0}, {ADDRESS_capture_decimation, 0},
                  {ADDRESS_capture_trigger, 5}, {ADDRESS_setpoint_slew, 0x8000}};
    for (size_t i = 0; i < sizeof faults / sizeof faults[0]; i++) {
        uint16_t request[COUNT];
        memcpy(request, good, sizeof request);
        request[faults[i].address - FIRST] = faults[i].bad;
        TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_VALUE, master_write(FIRST, COUNT, request));
        TEST_ASSERT_EQUAL(MODBUS_OK, master_read(FIRST, COUNT, after));
        TEST_ASSERT_EQUAL_HEX16_ARRAY(before, after, COUNT);
        TEST_ASSERT_EQUAL(HYST_MODE_PARK, loop_mode());
    }
    /* one register further is half of a value: nothing of the good part may stick either */
    TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_ADDRESS, master_write(FIRST, COUNT + 1, good));
    TEST_ASSERT_EQUAL(HYST_MODE_PARK, loop_mode());
    TEST_ASSERT_EQUAL(MODBUS_OK, master_write(FIRST, COUNT, good));
    TEST_ASSERT_EQUAL(HYST_MODE_LINEAR, loop_mode());
}

static void test_a_command_comes_after_the_settings_of_its_request(void) {
    /* start is impossible while parked: the mode in the same request makes it possible */
    TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_VALUE, master_set(INDEX_command, COMMAND_START));
    const uint16_t request[] = {COMMAND_START, HYST_MODE_LINEAR, 0, 0, SOURCE_SINE, 0, 0, 0, 0, 0x0100, 0};
    TEST_ASSERT_EQUAL(MODBUS_OK, master_write(ADDRESS_command, 11, request));
    (void)fake_board_run(1);
    TEST_ASSERT_EQUAL_UINT32(LOOP_PLAYING, master_get(INDEX_state));
}

static void test_blocks_keep_words_and_end_where_they_end(void) {
    const uint16_t values[] = {0x1234, 0x5678, 0x9ABC};
    uint16_t back[3];
    static const uint16_t blocks[][2] = {
        {ADDRESS_waveform, LENGTH_waveform}, {ADDRESS_staging, LENGTH_staging}, {ADDRESS_tones, LENGTH_tones}};
    for (size_t i = 0; i < sizeof blocks / sizeof blocks[0]; i++) {
        const uint16_t end = (uint16_t)(blocks[i][0] + blocks[i][1]);
        for (uint16_t offset = 0; offset < 5; offset++) {
            TEST_ASSERT_EQUAL(MODBUS_OK, master_write((uint16_t)(blocks[i][0] + offset), 3, values));
            TEST_ASSERT_EQUAL(MODBUS_OK, master_read((uint16_t)(blocks[i][0] + offset), 3, back));
            TEST_ASSERT_EQUAL_HEX16_ARRAY(values, back, 3);
        }
        TEST_ASSERT_EQUAL(MODBUS_OK, master_write((uint16_t)(end - 3), 3, values));
        TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_ADDRESS, master_write((uint16_t)(end - 2), 3, values));
        TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_ADDRESS, master_read((uint16_t)(end - 2), 3, back));
        TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_ADDRESS, master_read((uint16_t)(blocks[i][0] - 1), 3, back));
    }
}

static void test_the_breakpoint_table_cannot_change_while_it_plays(void) {
    const uint32_t points[] = {1000, 1U << 30};
    const uint16_t value = 0;
    master_write_words(ADDRESS_waveform, points, 2);
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_waveform_points, 1));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_source, SOURCE_BREAKPOINTS));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_source_cycles, 1));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_mode, HYST_MODE_LINEAR));
    master_command(COMMAND_START);
    TEST_ASSERT_EQUAL(MODBUS_DEVICE_FAILURE, master_write(ADDRESS_waveform, 1, &value));
    expect_refusal(WRITE_PLAYS, ADDRESS_waveform);
    (void)fake_board_run(1000);
    TEST_ASSERT_EQUAL(MODBUS_OK, master_write(ADDRESS_waveform, 1, &value));
}

static void test_the_tones_cannot_change_while_they_play(void) {
    const uint32_t tones[] = {1, 1U << 29, 0, 3, 1U << 28, 1U << 30};
    const uint16_t value = 0;
    master_write_words(ADDRESS_tones, tones, 6);
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_source_tones, 2));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_source, SOURCE_MULTISINE));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_source_cycles, 1));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_mode, HYST_MODE_LINEAR));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_source_increment, 1U << 30)); /* three of it are too much */
    TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_VALUE, master_set(INDEX_command, COMMAND_START));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_source_increment, 1U << 24));
    master_command(COMMAND_START);
    TEST_ASSERT_EQUAL(MODBUS_DEVICE_FAILURE, master_write(ADDRESS_tones, 1, &value));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_write(ADDRESS_waveform, 1, &value));
    (void)fake_board_run(257);
    TEST_ASSERT_EQUAL(MODBUS_OK, master_write(ADDRESS_tones, 1, &value));
}

static void test_a_sweep_is_started_by_its_registers(void) {
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_mode, HYST_MODE_LINEAR));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_source, SOURCE_SWEEP));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_source_cycles, 1));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_source_increment, 1U << 24));
    TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_VALUE, master_set(INDEX_command, COMMAND_START)); /* no end, no length */
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_sweep_increment, 1U << 26));
    TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_VALUE, master_set(INDEX_command, COMMAND_START)); /* no length */
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_sweep_spacing, SWEEP_LOGARITHMIC));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_sweep_samples, 2));
    TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_VALUE, master_set(INDEX_command, COMMAND_START)); /* an octave a sample */
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_sweep_samples, 500));
    master_command(COMMAND_START);
    (void)fake_board_run(500);
    TEST_ASSERT_EQUAL_UINT32(LOOP_PLAYING, master_get(INDEX_state));
    (void)fake_board_run(65); /* a turn at the end */
    TEST_ASSERT_EQUAL_UINT32(LOOP_IDLE, master_get(INDEX_state));
}

/* Telemetry is one sample's, and stays it until the sequence is read again. */
static void test_telemetry_is_latched(void) {
    uint16_t first[2], position[2], later[2];
    (void)fake_board_sample(0x11110000);
    TEST_ASSERT_EQUAL(MODBUS_OK, master_read(ADDRESS_sequence, 2, first));
    (void)fake_board_sample(0x22220000);
    TEST_ASSERT_EQUAL(MODBUS_OK, master_read(ADDRESS_position, 2, position));
    TEST_ASSERT_EQUAL_HEX16(0x1111, position[0]);
    TEST_ASSERT_EQUAL(MODBUS_OK, master_read(ADDRESS_sequence + 1, 1, later));
    TEST_ASSERT_EQUAL_UINT16_MESSAGE(first[1], later[0], "the low half belongs to the same snapshot");
    TEST_ASSERT_EQUAL(MODBUS_OK, master_read(ADDRESS_sequence, 2, later));
    TEST_ASSERT_EQUAL_UINT16(first[1] + 1, later[1]);
    TEST_ASSERT_EQUAL(MODBUS_OK, master_read(ADDRESS_position, 2, position));
    TEST_ASSERT_EQUAL_HEX16(0x2222, position[0]);
    (void)fake_board_sample(0x33330000);
    master_command(COMMAND_LATCH);
    TEST_ASSERT_EQUAL(MODBUS_OK, master_read(ADDRESS_position, 2, position));
    TEST_ASSERT_EQUAL_HEX16(0x3333, position[0]);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_the_table_is_in_order_and_nothing_overlaps);
    RUN_TEST(test_exactly_the_registers_of_the_table_can_be_read);
    RUN_TEST(test_identity);
    RUN_TEST(test_writable_registers_keep_what_is_written);
    RUN_TEST(test_read_only_registers_refuse);
    RUN_TEST(test_the_command_reads_as_0);
    RUN_TEST(test_values_out_of_range);
    RUN_TEST(test_why_a_write_was_refused);
    RUN_TEST(test_a_two_register_value_is_written_only_whole);
    RUN_TEST(test_a_request_with_one_bad_value_changes_nothing);
    RUN_TEST(test_a_command_comes_after_the_settings_of_its_request);
    RUN_TEST(test_blocks_keep_words_and_end_where_they_end);
    RUN_TEST(test_the_breakpoint_table_cannot_change_while_it_plays);
    RUN_TEST(test_the_tones_cannot_change_while_they_play);
    RUN_TEST(test_a_sweep_is_started_by_its_registers);
    RUN_TEST(test_telemetry_is_latched);
    return UNITY_END();
}
