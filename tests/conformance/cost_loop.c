/* SPDX-License-Identifier: MIT */
#include "cost_loop.h"
#include "board.h"
#include "console.h"
#include "loop/capture.h"
#include "loop/loop.h"
#include "motion/sweep.h"
#include "protection/health_watch.h"
#include "registers/control.h"
#include "registers/registers.h"
#include "startup.h"

enum { POINTS = 128, SAMPLES = 1000 };

void board_modbus_send(const uint8_t *frame, size_t length) {
    (void)frame;
    (void)length;
}

bool board_modbus_baud_possible(uint32_t baud) {
    (void)baud;
    return true;
}

void board_modbus_line(uint32_t baud, line_parity_t parity) {
    (void)baud;
    (void)parity;
}

uint32_t board_lock(void) {
    return 0; /* the interrupt is called, and never interrupts */
}

const uint32_t *board_store_sector(unsigned sector) {
    static const uint32_t nothing[BOARD_STORE_WORDS];
    (void)sector;
    return nothing;
}

bool board_store_erase(unsigned sector) {
    (void)sector;
    return false;
}

bool board_store_program(unsigned sector, size_t word, uint32_t value) {
    (void)sector;
    (void)word;
    (void)value;
    return false;
}

void board_unlock(uint32_t key) {
    (void)key;
}

static void write_registers(uint16_t address, uint16_t count, const uint16_t *values) {
    if (registers_write(address, count, values) != MODBUS_OK) {
        console_write("cost: the amplifier refuses a setting\n");
        console_exit(1);
    }
}

static void write_word(uint16_t address, uint32_t word) {
    const uint16_t values[2] = {(uint16_t)(word >> 16), (uint16_t)word};
    write_registers(address, 2, values);
}

static void write_one(uint16_t address, uint16_t value) {
    write_registers(address, 1, &value);
}

static void cost_sample(cost_t *cost) {
    health_watch_main_turned();
    const uint32_t before = cost_counter();
    tim2_handler();
    cost_add(cost, cost_counter() - before - cost_of_looking());
}

void cost_unlock(void) {
    write_one(ADDRESS_unlock, CONTROL_KEY_PARAMETERS);
    write_one(ADDRESS_unlock, CONTROL_KEY_OUTPUT);
}

/* On. All images here are parked where the loop starts. */
static void arm(void) {
    cost_t ignored = {0};
    write_one(ADDRESS_watchdog, 0);
    write_one(ADDRESS_command, COMMAND_ARM);
    while (!loop_ready()) {
        cost_sample(&ignored);
    }
}

uint32_t cost_adopt(cost_t *adopting, const hyst_parameters_t *parameters, cost_setpoint_t setpoint) {
    static uint32_t image[HYST_IMAGE_MAX_WORDS];
    const size_t words = hyst_parameters_encode(parameters, image, HYST_IMAGE_MAX_WORDS);
    for (size_t i = 0; i < words; i++) {
        write_word((uint16_t)(ADDRESS_staging + 2U * i), image[i]);
    }
    write_one(ADDRESS_command, COMMAND_COMMIT);
    uint32_t samples = 0;
    for (; loop_adoption_pending(); samples++) {
        if (setpoint != NULL) {
            loop_set_setpoint(setpoint(samples));
        }
        cost_sample(adopting);
    }
    if (!loop_armed()) {
        arm();
    }
    return samples;
}

void cost_hold(hyst_mode_t mode, cost_setpoint_t setpoint, uint32_t samples) {
    cost_t ignored = {0};
    write_one(ADDRESS_command, COMMAND_STOP);
    write_one(ADDRESS_source, SOURCE_HOLD);
    write_one(ADDRESS_mode, (uint16_t)mode);
    write_word(ADDRESS_setpoint_slew, (uint32_t)HYST_Q31_MAX);
    for (uint32_t k = 0; k < samples; k++) {
        loop_set_setpoint(setpoint(k));
        cost_sample(&ignored);
    }
}

void cost_measure_loop(cost_t *playing, cost_t *adopting, const hyst_parameters_t *parameters, cost_source_t source,
                       const hyst_q31_t steps[128]) {
    (void)cost_adopt(adopting, parameters, NULL);
    write_one(ADDRESS_command, COMMAND_STOP); /* breakpoints that play cannot be changed */
    for (unsigned i = 0; i < POINTS; i++) {
        write_word((uint16_t)(ADDRESS_waveform + 4U * i), 0);
        write_word((uint16_t)(ADDRESS_waveform + 4U * i + 2U), (uint32_t)steps[i]);
    }
    write_one(ADDRESS_waveform_points, POINTS);
    write_word(ADDRESS_source_amplitude, (uint32_t)HYST_Q31_MAX);
    write_word(ADDRESS_source_increment, UINT32_MAX / 97U);
    write_one(ADDRESS_source, source == COST_SINE ? SOURCE_SINE : SOURCE_BREAKPOINTS);
    write_one(ADDRESS_mode, HYST_MODE_COMPENSATE);
    write_one(ADDRESS_command, COMMAND_ARM_CAPTURE);
    write_one(ADDRESS_command, COMMAND_START);
    cost_sample(adopting); /* the filters settle */
    for (unsigned k = 1; k < SAMPLES; k++) {
        cost_sample(playing);
    }
}

void cost_measure_source(cost_t *playing, source_kind_t source, uint16_t signals) {
    write_one(ADDRESS_command, COMMAND_STOP);
    for (unsigned i = 0; i < SOURCE_TONES_MAX; i++) {
        write_word((uint16_t)(ADDRESS_tones + 6U * i), i + 1U);
        write_word((uint16_t)(ADDRESS_tones + 6U * i + 2U), (uint32_t)(HYST_Q31_MAX / (int32_t)SOURCE_TONES_MAX));
        write_word((uint16_t)(ADDRESS_tones + 6U * i + 4U), i * (UINT32_MAX / 7U));
    }
    write_one(ADDRESS_source_tones, SOURCE_TONES_MAX);
    write_word(ADDRESS_source_amplitude, (uint32_t)HYST_Q31_MAX / 2U);
    write_word(ADDRESS_source_increment, UINT32_MAX / 970U);
    write_word(ADDRESS_sweep_increment, UINT32_MAX / 97U);
    write_word(ADDRESS_sweep_samples, SAMPLES / 3U);
    write_one(ADDRESS_sweep_spacing, SWEEP_LOGARITHMIC);
    write_one(ADDRESS_source, (uint16_t)source);
    write_one(ADDRESS_mode, HYST_MODE_COMPENSATE);
    write_one(ADDRESS_capture_signals, signals);
    write_one(ADDRESS_command, COMMAND_ARM_CAPTURE);
    write_one(ADDRESS_command, COMMAND_START);
    cost_t first = {0}; /* the filters settle */
    cost_sample(&first);
    for (unsigned k = 1; k < SAMPLES; k++) {
        cost_sample(playing);
    }
    write_one(ADDRESS_command, COMMAND_STOP);
    write_one(ADDRESS_capture_signals, CAPTURE_DEFAULT_SIGNALS);
}
