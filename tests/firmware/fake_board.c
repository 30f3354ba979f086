/* SPDX-License-Identifier: MIT */
#include "fake_board.h"
#include "amplifier.h"
#include "loop/loop.h"
#include "loop/telemetry.h"
#include "protection/health_watch.h"
#include "registers/control.h"
#include "registers/registers.h"
#include "store/parameter_store.h"
#include "unity.h"
#include <string.h>

fake_board_t fake_board;
uint32_t fake_core_hz = 168000000;
void (*fake_board_sends)(const uint8_t *frame, size_t length);

const board_info_t board_info = {.id = 0,
                                 .latency_samples = FAKE_LATENCY,
                                 .sampled_after_ns = FAKE_SAMPLED_AFTER_NS,
                                 .position_bits = FAKE_CONVERTER_BITS,
                                 .drive_bits = FAKE_CONVERTER_BITS,
                                 .sample_rate_mhz = 1000000000U / FAKE_SAMPLE_US,
                                 .cost_rate_hz = 1000000,
                                 .modbus_silence_us = FAKE_SILENCE_US,
                                 .modbus_ends_at_length = FAKE_ENDS_AT_LENGTH,
                                 .safe_code = FAKE_SAFE_CODE,
                                 .drive_slew_max = FAKE_DRIVE_SLEW_MAX,
                                 .fault_slew_min = FAKE_FAULT_SLEW_MIN,
                                 .image_limits = {.transition_slew_min = FAKE_TRANSITION_SLEW_MIN,
                                                  .transition_slew_max = FAKE_TRANSITION_SLEW_MAX,
                                                  .filter_gain_max = FAKE_FILTER_GAIN_MAX},
                                 .health = FAKE_HEALTH};

uint32_t board_cost_counter(void) {
    fake_board.cost += fake_board.cost_per_look;
    return fake_board.cost;
}

uint32_t board_microseconds(void) {
    return fake_board.microseconds;
}

void board_modbus_send(const uint8_t *frame, size_t length) {
    TEST_ASSERT_LESS_OR_EQUAL_UINT(sizeof fake_board.sent, length);
    memcpy(fake_board.sent, frame, length);
    fake_board.sent_length = length;
    fake_board.frames_sent++;
    if (fake_board_sends != NULL) {
        fake_board_sends(frame, length);
    }
}

static void interrupt(void) {
    if (fake_board.locks == 0 && fake_board.interrupt != NULL) {
        fake_board.interrupt();
    }
}

uint32_t board_lock(void) {
    interrupt();
    return fake_board.locks++;
}

void board_unlock(uint32_t key) {
    fake_board.locks--;
    TEST_ASSERT_EQUAL_UINT_MESSAGE(key, fake_board.locks, "locks must nest");
    interrupt();
}

uint32_t board_core_hz(void) {
    return fake_core_hz;
}

/* An UART of the STM32 at 84 MHz. */
bool board_modbus_baud_possible(uint32_t baud) {
    return line_divider(84000000, baud) != 0;
}

void board_modbus_line(uint32_t baud, line_parity_t parity) {
    fake_board.baud = baud;
    fake_board.parity = parity;
    fake_board.frames_before_line = fake_board.frames_sent;
}

void board_stage_enable(bool on) {
    fake_board.stage_enabled = on;
}

void board_keep_park(uint16_t drive_code) {
    fake_board.kept_park = drive_code;
}

int32_t board_health(health_channel_t channel) {
    return fake_board.health[channel];
}

bool board_output_follows(void) {
    return !fake_board.output_stuck;
}

void board_health_convert(void) {
}

void board_watchdog_feed(void) {
    fake_board.watchdog_fed++;
}

void fake_board_start_locked(const board_start_t *start) {
    memset(&fake_board, 0, sizeof fake_board);
    fake_board.health[HEALTH_TEMPERATURE] = FAKE_TEMPERATURE;
    fake_board.health[HEALTH_SUPPLY] = FAKE_SUPPLY;
    fake_board.health[HEALTH_HIGH_VOLTAGE] = FAKE_HIGH_VOLTAGE;
    amplifier_init(start);
}

void fake_board_start(const board_start_t *start) {
    static const uint16_t keys[] = {CONTROL_KEY_PARAMETERS, CONTROL_KEY_OUTPUT};
    fake_board_start_locked(start);
    for (unsigned i = 0; i < 2; i++) {
        TEST_ASSERT_EQUAL(MODBUS_OK, registers_write(ADDRESS_unlock, 1, &keys[i]));
    }
}

static void command(uint16_t command) {
    TEST_ASSERT_EQUAL(MODBUS_OK, registers_write(ADDRESS_command, 1, &command));
}

void fake_board_power_on(uint16_t faults) {
    static const uint16_t no_timeout = 0;
    const board_start_t start = {.faults = faults, .reset_cause = RESET_POWER, .starts = 1, .serial = FAKE_SERIAL};
    hyst_parameters_t parameters;
    fake_store_clear();
    fake_board_start(&start);
    hyst_parameters_default(&parameters);
    (void)hyst_parameters_encode(&parameters, parameter_store_staging(), PARAMETER_STORE_WORDS);
    command(COMMAND_COMMIT);
    TEST_ASSERT_TRUE(parameter_store_image_given());
    memset(parameter_store_staging(), 0, PARAMETER_STORE_WORDS * sizeof(uint32_t));
    TEST_ASSERT_EQUAL(MODBUS_OK, registers_write(ADDRESS_watchdog, 1, &no_timeout));
    command(COMMAND_ARM);
    (void)fake_board_run(FAKE_SAMPLES); /* from the safe code to the middle in 1000, precharge in another 1000 */
    TEST_ASSERT_TRUE(loop_ready());
    command(COMMAND_CLEAR);
    fake_board.microseconds = 0;
}

uint16_t fake_board_sample(hyst_q31_t position) {
    fake_board.microseconds += FAKE_SAMPLE_US;
    if (!fake_board.main_stalls) {
        health_watch_main_turned();
    }
    const loop_input_t input = {.position_code = (uint16_t)((uint32_t)position >> 16 ^ BOARD_CODE_MIDDLE)};
    return loop_sample(&input);
}

hyst_q31_t fake_board_drive(hyst_q31_t position) {
    return (hyst_q31_t)((uint32_t)(fake_board_sample(position) ^ BOARD_CODE_MIDDLE) << 16);
}

hyst_q31_t fake_board_run(unsigned count) {
    hyst_q31_t drive = 0;
    for (unsigned i = 0; i < count; i++) {
        drive = fake_board_drive(0);
    }
    return drive;
}

bool fake_board_lawful(uint32_t before, uint32_t after, uint32_t command, bool tripped) {
    if (before == after) {
        return true;
    }
    switch (after) {
    case AMPLIFIER_OFF:
        return before == AMPLIFIER_STOP || (before == AMPLIFIER_FAULT && command == COMMAND_STOP) ||
               (before != AMPLIFIER_FAULT && command == COMMAND_DISARM); /* parked already: off at once */
    case AMPLIFIER_PRECHARGE:
        return (before == AMPLIFIER_OFF || before == AMPLIFIER_STOP) && command == COMMAND_ARM;
    case AMPLIFIER_CONDITIONING:
    case AMPLIFIER_HOLD:
    case AMPLIFIER_RUN:
        return before == AMPLIFIER_PRECHARGE || before == AMPLIFIER_CONDITIONING || before == AMPLIFIER_HOLD ||
               before == AMPLIFIER_RUN;
    case AMPLIFIER_STOP:
        return before == AMPLIFIER_FAULT ? command == COMMAND_STOP : command == COMMAND_DISARM;
    default:
        return tripped;
    }
}
