/* SPDX-License-Identifier: MIT */
/* Who may do what: nothing moves and nothing changes before it is unlocked, each key opens its own, and what makes the
 * output safe is never locked. */
#include "fake_board.h"
#include "loop/loop.h"
#include "master.h"
#include "unity.h"

void setUp(void) {
    fake_board_power_on(0);
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_unlock, 0));
}
void tearDown(void) {
}

static void expect_locked(modbus_exception_t got, uint32_t why, uint16_t address) {
    TEST_ASSERT_EQUAL(MODBUS_DEVICE_FAILURE, got);
    TEST_ASSERT_EQUAL_UINT32(why, master_get(INDEX_write_refused));
    TEST_ASSERT_EQUAL_HEX16(address, master_get(INDEX_write_refused_at));
}

static const unsigned output[] = {INDEX_setpoint,         INDEX_source,         INDEX_source_offset,
                                  INDEX_source_amplitude, INDEX_source_cycles,  INDEX_source_increment,
                                  INDEX_waveform_points,  INDEX_sweep_spacing,  INDEX_sweep_samples,
                                  INDEX_source_tones,     INDEX_sweep_increment};
static const uint16_t commands_output[] = {COMMAND_START, COMMAND_CONDITION, COMMAND_ARM};
static const uint16_t commands_free[] = {COMMAND_NONE, COMMAND_STOP, COMMAND_PARK, COMMAND_LATCH, COMMAND_DISARM};

static bool is_output(unsigned index) {
    bool found = index == INDEX_mode;
    for (size_t i = 0; i < sizeof output / sizeof output[0]; i++) {
        found = found || output[i] == index;
    }
    return found;
}

static void expect_everything_locked(bool parameters, bool out) {
    for (unsigned i = 0; i < REGISTER_COUNT; i++) {
        const register_info_t *info = &register_table[i];
        if (info->access != REGISTER_RW) {
            continue;
        }
        const bool locked = i == INDEX_stream_from ? false : is_output(i) ? out : parameters; /* a place to read at */
        const uint32_t before = master_get(i);
        const modbus_exception_t got = master_set(i, master_value_in_range(i));
        if (locked) {
            expect_locked(got, is_output(i) ? WRITE_OUTPUT_LOCKED : WRITE_PARAMETERS_LOCKED, info->address);
            TEST_ASSERT_EQUAL_UINT32_MESSAGE(before, master_get(i), info->name);
        } else {
            TEST_ASSERT_EQUAL_MESSAGE(MODBUS_OK, got, info->name);
        }
    }
}

static void test_a_start_is_read_only(void) {
    static const board_start_t start = {.reset_cause = RESET_POWER, .starts = 1};
    const uint16_t values[] = {1, 2};
    fake_board_start_locked(&start);
    TEST_ASSERT_EQUAL_UINT32(0, master_get(INDEX_unlocked));
    TEST_ASSERT_EQUAL_HEX32(REGISTERS_MAGIC, master_get(INDEX_magic));
    expect_locked(master_write(ADDRESS_staging, 2, values), WRITE_PARAMETERS_LOCKED, ADDRESS_staging);
    expect_locked(master_set(INDEX_command, COMMAND_COMMIT), WRITE_PARAMETERS_LOCKED, ADDRESS_command);
    TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_VALUE, master_set(INDEX_unlock, 1)); /* no key */
    TEST_ASSERT_EQUAL_UINT32(0, master_get(INDEX_unlocked));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_unlock, CONTROL_KEY_PARAMETERS));
    TEST_ASSERT_EQUAL_UINT32(0, master_get(INDEX_unlock));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_write(ADDRESS_staging, 2, values));
}

static void test_every_register_is_locked(void) {
    const uint16_t values[] = {1, 2};
    expect_everything_locked(true, true);
    expect_locked(master_write(ADDRESS_waveform, 2, values), WRITE_OUTPUT_LOCKED, ADDRESS_waveform);
    expect_locked(master_write(ADDRESS_tones + 2, 2, values), WRITE_OUTPUT_LOCKED, ADDRESS_tones + 2);
    expect_locked(master_write(ADDRESS_staging, 2, values), WRITE_PARAMETERS_LOCKED, ADDRESS_staging);
    expect_locked(master_set(INDEX_command, COMMAND_CLEAR), WRITE_PARAMETERS_LOCKED, ADDRESS_command);
    expect_locked(master_set(INDEX_command, COMMAND_ARM_CAPTURE), WRITE_PARAMETERS_LOCKED, ADDRESS_command);
}

static void test_each_key_opens_its_own(void) {
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_unlock, CONTROL_KEY_OUTPUT));
    TEST_ASSERT_EQUAL_UINT32(CONTROL_OUTPUT, master_get(INDEX_unlocked));
    expect_everything_locked(true, false);
    setUp();
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_unlock, CONTROL_KEY_PARAMETERS));
    TEST_ASSERT_EQUAL_UINT32(CONTROL_PARAMETERS, master_get(INDEX_unlocked));
    expect_everything_locked(false, true);
}

static void test_what_turns_it_on_is_locked_and_what_stops_it_is_not(void) {
    static const uint8_t coil_on[] = {5, 0, 0, 0xFF, 0}, coil_off[] = {5, 0, 0, 0, 0};
    uint8_t answer[MODBUS_FRAME_MAX];
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_unlock, CONTROL_KEY_OUTPUT));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_mode, HYST_MODE_DIRECT));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_setpoint, 1U << 30));
    (void)fake_board_run(3000);
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_unlock, 0));
    const hyst_q31_t drive = fake_board_run(1);
    for (size_t i = 0; i < sizeof commands_output / sizeof commands_output[0]; i++) {
        expect_locked(master_set(INDEX_command, commands_output[i]), WRITE_OUTPUT_LOCKED, ADDRESS_command);
    }
    TEST_ASSERT_EQUAL_UINT(2, master_ask(coil_on, sizeof coil_on, answer));
    TEST_ASSERT_EQUAL_UINT8(MODBUS_DEVICE_FAILURE, answer[1]);
    expect_locked(master_set(INDEX_mode, HYST_MODE_LINEAR), WRITE_OUTPUT_LOCKED, ADDRESS_mode);
    TEST_ASSERT_EQUAL_INT32(drive, fake_board_run(100));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_mode, HYST_MODE_PARK));
    TEST_ASSERT_EQUAL_INT32(0, fake_board_run(5000));
    for (size_t i = 0; i < sizeof commands_free / sizeof commands_free[0]; i++) {
        TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_command, commands_free[i]));
    }
    TEST_ASSERT_EQUAL_UINT(5, master_ask(coil_off, sizeof coil_off, answer));
}

/* A request that unlocks does not open the door for itself, and one locked register refuses all of it. */
static void test_a_request_is_locked_as_a_whole(void) {
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_unlock, CONTROL_KEY_OUTPUT));
    const uint16_t looks_and_key[] = {7, CONTROL_KEY_PARAMETERS};
    expect_locked(master_write(ADDRESS_health_looks, 2, looks_and_key), WRITE_PARAMETERS_LOCKED, ADDRESS_health_looks);
    TEST_ASSERT_EQUAL_UINT32(CONTROL_OUTPUT, master_get(INDEX_unlocked));
    const uint16_t points_and_decimation[] = {3, 7};
    expect_locked(master_write(ADDRESS_waveform_points, 2, points_and_decimation), WRITE_PARAMETERS_LOCKED,
                  ADDRESS_capture_decimation);
    TEST_ASSERT_EQUAL_UINT32(0, master_get(INDEX_waveform_points));
}

static void test_when_the_position_is_sampled(void) {
    TEST_ASSERT_EQUAL_UINT32(FAKE_SAMPLED_AFTER_NS, master_get(INDEX_sampled_after));
}

static void test_the_serial_number(void) {
    static const board_start_t start = {.serial = {0x0012ABCD, 0x34567890, 0xFEDCBA98}};
    static const uint8_t individual[] = {43, 14, 4, 0x80}, stream[] = {43, 14, 3, 0}, basic[] = {43, 14, 1, 0},
                         from_serial[] = {43, 14, 3, 0x80};
    uint8_t answer[MODBUS_FRAME_MAX];
    fake_board_start_locked(&start);
    TEST_ASSERT_EQUAL_HEX32(0x0012ABCD, master_get(INDEX_serial_high));
    TEST_ASSERT_EQUAL_HEX32(0x34567890, master_get(INDEX_serial_middle));
    TEST_ASSERT_EQUAL_HEX32(0xFEDCBA98, master_get(INDEX_serial_low));
    TEST_ASSERT_EQUAL_UINT(33, master_ask(individual, sizeof individual, answer));
    TEST_ASSERT_EQUAL_HEX8(0x80, answer[7]);
    TEST_ASSERT_EQUAL_UINT8(24, answer[8]);
    TEST_ASSERT_EQUAL_MEMORY("0012ABCD34567890FEDCBA98", answer + 9, 24);
    const size_t three = master_ask(basic, sizeof basic, answer);
    TEST_ASSERT_EQUAL_UINT8(3, answer[6]);
    TEST_ASSERT_EQUAL_UINT(three + 26U, master_ask(stream, sizeof stream, answer));
    TEST_ASSERT_EQUAL_UINT8(4, answer[6]);
    TEST_ASSERT_EQUAL_HEX8(0x80, answer[three]);
    TEST_ASSERT_EQUAL_UINT(33, master_ask(from_serial, sizeof from_serial, answer));
    TEST_ASSERT_EQUAL_UINT8(1, answer[6]);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_start_is_read_only);
    RUN_TEST(test_every_register_is_locked);
    RUN_TEST(test_each_key_opens_its_own);
    RUN_TEST(test_what_turns_it_on_is_locked_and_what_stops_it_is_not);
    RUN_TEST(test_a_request_is_locked_as_a_whole);
    RUN_TEST(test_when_the_position_is_sampled);
    RUN_TEST(test_the_serial_number);
    return UNITY_END();
}
