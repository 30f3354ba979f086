/* SPDX-License-Identifier: MIT */
#include "control.h"
#include "board.h"
#include "capture.h"
#include "loop.h"
#include "modbus_server.h"
#include "parameter_store.h"
#include "register_blocks.h"

enum { WAVEFORM_CAPACITY = LENGTH_waveform / 4 };

void control_init(uint32_t value[REGISTER_COUNT]) {
    value[INDEX_magic] = REGISTERS_MAGIC;
    value[INDEX_abi] = REGISTERS_ABI;
    value[INDEX_firmware_version] =
        (uint32_t)HYST_VERSION_MAJOR * 4096U + (uint32_t)HYST_VERSION_MINOR * 64U + (uint32_t)HYST_VERSION_PATCH;
    value[INDEX_board] = board_info.id;
    value[INDEX_sample_rate] = board_info.sample_rate_mhz;
    value[INDEX_cost_rate] = board_info.cost_rate_hz;
    value[INDEX_image_version] = HYST_IMAGE_VERSION;
    value[INDEX_latency] = board_info.latency_samples;
    value[INDEX_position_bits] = board_info.position_bits;
    value[INDEX_drive_bits] = board_info.drive_bits;
    value[INDEX_capture_capacity] = CAPTURE_CAPACITY;
    value[INDEX_waveform_capacity] = WAVEFORM_CAPACITY;
    value[INDEX_capture_decimation] = 1;
    value[INDEX_capture_length] = CAPTURE_CAPACITY;
    value[INDEX_setpoint_slew] = LOOP_DEFAULT_SLEW;
}

static source_settings_t source_settings(const uint32_t value[REGISTER_COUNT]) {
    return (source_settings_t){.kind = (source_kind_t)value[INDEX_source],
                               .offset = (hyst_q31_t)value[INDEX_source_offset],
                               .amplitude = (hyst_q31_t)value[INDEX_source_amplitude],
                               .increment = value[INDEX_source_increment],
                               .cycles = value[INDEX_source_cycles],
                               .points = register_blocks_waveform(),
                               .point_count = value[INDEX_waveform_points]};
}

static bool command_possible(const uint32_t value[REGISTER_COUNT]) {
    const source_settings_t settings = source_settings(value);
    switch (value[INDEX_command]) {
    case COMMAND_COMMIT:
        return !loop_adoption_pending();
    case COMMAND_START:
        return value[INDEX_mode] != HYST_MODE_PARK && !loop_conditioning() && source_settings_valid(&settings);
    case COMMAND_NONE:
    case COMMAND_STOP:
    case COMMAND_CONDITION:
    case COMMAND_ARM_CAPTURE:
    case COMMAND_CLEAR:
    case COMMAND_PARK:
    case COMMAND_LATCH:
        return true;
    default:
        return false;
    }
}

bool control_setting_valid(unsigned index, const uint32_t value[REGISTER_COUNT]) {
    const uint32_t x = value[index];
    switch (index) {
    case INDEX_command:
        return command_possible(value);
    case INDEX_mode:
        return x <= HYST_MODE_COMPENSATE;
    case INDEX_source:
        return x <= SOURCE_BREAKPOINTS;
    case INDEX_waveform_points:
        return x <= WAVEFORM_CAPACITY;
    case INDEX_capture_decimation:
    case INDEX_capture_length:
        return x > 0;
    case INDEX_capture_trigger:
        return x <= CAPTURE_AT_SOURCE;
    case INDEX_setpoint_slew:
        return (hyst_q31_t)x > 0;
    default:
        return true;
    }
}

void control_apply(unsigned index, const uint32_t value[REGISTER_COUNT]) {
    switch (index) {
    case INDEX_mode:
        loop_set_mode((hyst_mode_t)value[INDEX_mode]);
        break;
    case INDEX_setpoint:
        loop_set_setpoint((hyst_q31_t)value[INDEX_setpoint]);
        break;
    case INDEX_setpoint_slew:
        loop_set_setpoint_slew((hyst_q31_t)value[INDEX_setpoint_slew]);
        break;
    default: /* the others are looked at when a command or the main loop needs them */
        break;
    }
}

static void start(const uint32_t value[REGISTER_COUNT]) {
    const source_settings_t settings = source_settings(value);
    loop_start(&settings);
}

static void arm_capture(const uint32_t value[REGISTER_COUNT]) {
    const capture_settings_t settings = {.decimation = (uint16_t)value[INDEX_capture_decimation],
                                         .length = (uint16_t)value[INDEX_capture_length],
                                         .trigger = (capture_trigger_t)value[INDEX_capture_trigger]};
    const uint32_t key = board_lock();
    capture_arm(&settings);
    board_unlock(key);
}

void control_execute(control_command_t command, uint32_t value[REGISTER_COUNT]) {
    switch (command) {
    case COMMAND_NONE:
        break;
    case COMMAND_COMMIT:
        parameter_store_commit();
        break;
    case COMMAND_START:
        start(value);
        break;
    case COMMAND_STOP:
        loop_stop();
        break;
    case COMMAND_CONDITION:
        loop_condition();
        break;
    case COMMAND_ARM_CAPTURE:
        arm_capture(value);
        break;
    case COMMAND_CLEAR:
        loop_clear();
        modbus_server_clear();
        break;
    case COMMAND_PARK:
        loop_set_mode(HYST_MODE_PARK);
        break;
    case COMMAND_LATCH:
        control_latch(value);
        break;
    }
}

void control_refresh(uint32_t value[REGISTER_COUNT]) {
    const parameter_store_status_t status = parameter_store_status();
    const uint32_t *image = parameter_store_active();
    value[INDEX_mode] = loop_mode();
    value[INDEX_setpoint] = (uint32_t)loop_setpoint();
    value[INDEX_fault_code] = status.fault.error;
    value[INDEX_fault_field] = status.fault.field;
    value[INDEX_fault_element] = status.fault.element;
    value[INDEX_active_words] = image[2]; /* hyst/parameters.h: word 2 is the length, word 3 the model */
    value[INDEX_active_model_id] = image[3];
    value[INDEX_commits] = status.commits;
}

void control_latch(uint32_t value[REGISTER_COUNT]) {
    telemetry_t t;
    telemetry_read(&t);
#define LATCH(name) value[INDEX_##name] = (uint32_t)t.name
    LATCH(sequence);
    LATCH(state);
    LATCH(active_mode);
    LATCH(reference);
    LATCH(drive);
    LATCH(position);
    LATCH(samples);
    LATCH(drive_limited);
    LATCH(unreachable);
    LATCH(filter_saturated);
    LATCH(overruns);
    LATCH(converter_timeouts);
    LATCH(cost_last);
    LATCH(cost_max);
    LATCH(fault_first);
    LATCH(faults_sticky);
    LATCH(faults_live);
    LATCH(capture_state);
    LATCH(capture_frames);
#undef LATCH
    const modbus_counters_t line = modbus_server_counters();
    value[INDEX_line_errors] = line.errors;
    value[INDEX_frames_served] = line.served;
}
