/* SPDX-License-Identifier: MIT */
#include "registers/control.h"
#include "board.h"
#include "loop/capture.h"
#include "loop/loop.h"
#include "modbus/modbus_server.h"
#include "protection/health_watch.h"
#include "protection/model_watch.h"
#include "registers/register_blocks.h"
#include "store/event_log.h"
#include "store/parameter_store.h"
#include <string.h>

enum { WAVEFORM_CAPACITY = LENGTH_waveform / 4 };

static uint32_t command_needs(uint32_t command) {
    switch (command) {
    case COMMAND_NONE:
    case COMMAND_STOP:
    case COMMAND_PARK:
    case COMMAND_LATCH:
    case COMMAND_DISARM:
        return 0;
    case COMMAND_START:
    case COMMAND_CONDITION:
    case COMMAND_ARM:
        return CONTROL_OUTPUT;
    default:
        return CONTROL_PARAMETERS;
    }
}

uint32_t control_needs(unsigned index, uint32_t value) {
    switch (index) {
    case INDEX_command:
        return command_needs(value);
    case INDEX_unlock:
    case INDEX_stream_from:
        return 0;
    case INDEX_mode:
        return value == HYST_MODE_PARK ? 0 : CONTROL_OUTPUT;
    case INDEX_setpoint:
    case INDEX_source:
    case INDEX_source_offset:
    case INDEX_source_amplitude:
    case INDEX_source_increment:
    case INDEX_source_cycles:
    case INDEX_waveform_points:
    case INDEX_sweep_increment:
    case INDEX_sweep_samples:
    case INDEX_sweep_spacing:
    case INDEX_source_tones:
        return CONTROL_OUTPUT;
    default:
        return CONTROL_PARAMETERS;
    }
}

bool control_may_be_broadcast(unsigned index, uint32_t value) {
    switch (index) {
    case INDEX_command:
        return value == COMMAND_NONE || value == COMMAND_STOP || value == COMMAND_CLEAR || value == COMMAND_PARK ||
               value == COMMAND_LATCH || value == COMMAND_DISARM;
    case INDEX_mode:
        return value == HYST_MODE_PARK;
    case INDEX_unlock:
        return value == 0;
    default:
        return false;
    }
}

static void unlock(uint32_t value[REGISTER_COUNT], uint32_t key) {
    value[INDEX_unlocked] = key == 0                        ? 0
                            : key == CONTROL_KEY_PARAMETERS ? value[INDEX_unlocked] | CONTROL_PARAMETERS
                                                            : value[INDEX_unlocked] | CONTROL_OUTPUT;
}

/* The limits that are stored with the image (command 11): what a lab sets once for its stack. Not the communication
 * timeout: a start has it on, whatever was set. */
static const struct {
    uint16_t index, address;
} kept[] = {
#define KEPT(name)                                                                                                     \
    { INDEX_##name, ADDRESS_##name }
    KEPT(setpoint_slew),  KEPT(model_error_limit), KEPT(model_error_time),  KEPT(current_limit),
    KEPT(drive_low),      KEPT(drive_high),        KEPT(reference_low),     KEPT(reference_high),
    KEPT(reference_slew), KEPT(temperature_alert), KEPT(temperature_trip),  KEPT(supply_low),
    KEPT(supply_high),    KEPT(high_voltage_low),  KEPT(high_voltage_high), KEPT(health_looks),
    KEPT(capacitance),    KEPT(drive_slew),
#undef KEPT
};
#define KEPT_COUNT (sizeof kept / sizeof kept[0])
_Static_assert(KEPT_COUNT <= IMAGE_STORE_LIMITS_MAX, "they fit into a copy");

static bool put_stored(const stored_limit_t *limit, uint32_t candidate[REGISTER_COUNT]) {
    for (size_t k = 0; k < KEPT_COUNT; k++) {
        if (kept[k].address == limit->address) {
            candidate[kept[k].index] = limit->value;
            return true;
        }
    }
    return false;
}

/* Puts the stored limits in force, all or none. */
static bool restore_limits(uint32_t value[REGISTER_COUNT]) {
    stored_limit_t stored[IMAGE_STORE_LIMITS_MAX];
    uint32_t candidate[REGISTER_COUNT];
    const size_t count = parameter_store_limits(stored);
    memcpy(candidate, value, sizeof candidate);
    bool good = true;
    for (size_t i = 0; good && i < count; i++) {
        good = put_stored(&stored[i], candidate);
    }
    for (size_t k = 0; good && k < KEPT_COUNT; k++) {
        good = control_setting_valid(kept[k].index, candidate);
    }
    for (size_t k = 0; good && k < KEPT_COUNT; k++) {
        value[kept[k].index] = candidate[kept[k].index];
    }
    for (size_t k = 0; good && k < KEPT_COUNT; k++) {
        control_apply(kept[k].index, value);
    }
    return good;
}

static void save(const uint32_t value[REGISTER_COUNT]) {
    stored_limit_t limits[KEPT_COUNT];
    for (size_t k = 0; k < KEPT_COUNT; k++) {
        limits[k] = (stored_limit_t){.address = kept[k].address, .value = value[kept[k].index]};
    }
    parameter_store_save(limits, KEPT_COUNT);
}

void control_init(uint32_t value[REGISTER_COUNT], const board_start_t *start, const line_settings_t *line) {
    value[INDEX_magic] = REGISTERS_MAGIC;
    value[INDEX_abi] = REGISTERS_ABI;
    value[INDEX_firmware_version] =
        (uint32_t)HYST_VERSION_MAJOR * 4096U + (uint32_t)HYST_VERSION_MINOR * 64U + (uint32_t)HYST_VERSION_PATCH;
    value[INDEX_board] = board_info.id;
    value[INDEX_sample_rate] = board_info.sample_rate_mhz;
    value[INDEX_cost_rate] = board_info.cost_rate_hz;
    value[INDEX_image_version] = HYST_IMAGE_VERSION;
    value[INDEX_latency] = board_info.latency_samples;
    value[INDEX_sampled_after] = board_info.sampled_after_ns;
    value[INDEX_serial_high] = start->serial[0];
    value[INDEX_serial_middle] = start->serial[1];
    value[INDEX_serial_low] = start->serial[2];
    value[INDEX_position_bits] = board_info.position_bits;
    value[INDEX_drive_bits] = board_info.drive_bits;
    value[INDEX_capture_capacity] = CAPTURE_CAPACITY;
    value[INDEX_waveform_capacity] = WAVEFORM_CAPACITY;
    value[INDEX_capture_words] = CAPTURE_WORDS;
    value[INDEX_capture_signals] = CAPTURE_DEFAULT_SIGNALS;
    value[INDEX_model_error_time] = LOOP_DEFAULT_MODEL_TIME_MS;
    value[INDEX_capture_decimation] = 1;
    value[INDEX_capture_length] = CAPTURE_CAPACITY;
    value[INDEX_setpoint_slew] = LOOP_DEFAULT_SLEW;
    value[INDEX_watchdog] = LOOP_DEFAULT_TIMEOUT_MS;
    value[INDEX_drive_low] = value[INDEX_reference_low] = (uint32_t)HYST_Q31_MIN;
    value[INDEX_drive_high] = value[INDEX_reference_high] = (uint32_t)HYST_Q31_MAX;
    value[INDEX_drive_slew] = value[INDEX_reference_slew] = (uint32_t)board_info.drive_slew_max;
    value[INDEX_temperature_alert] = (uint32_t)board_info.health.temperature_alert;
    value[INDEX_temperature_trip] = (uint32_t)board_info.health.temperature_trip;
    value[INDEX_supply_low] = (uint32_t)board_info.health.supply_low;
    value[INDEX_supply_high] = (uint32_t)board_info.health.supply_high;
    value[INDEX_high_voltage_low] = (uint32_t)board_info.health.high_voltage_low;
    value[INDEX_high_voltage_high] = (uint32_t)board_info.health.high_voltage_high;
    value[INDEX_health_looks] = HEALTH_WATCH_LOOKS;
    value[INDEX_reset_cause] = start->reset_cause;
    value[INDEX_starts] = start->starts;
    value[INDEX_fault_address] = start->fault_address;
    value[INDEX_fault_status] = start->fault_status;
    value[INDEX_line_address] = line->address;
    value[INDEX_line_baud] = line->baud;
    value[INDEX_line_parity] = line->parity;
    if (!restore_limits(value)) {
        parameter_store_refuse_limits();
    }
}

static line_settings_t line_settings(const uint32_t value[REGISTER_COUNT]) {
    return (line_settings_t){
        .address = value[INDEX_line_address], .baud = value[INDEX_line_baud], .parity = value[INDEX_line_parity]};
}

static source_settings_t source_settings(const uint32_t value[REGISTER_COUNT]) {
    source_settings_t settings = {.kind = (source_kind_t)value[INDEX_source],
                                  .offset = (hyst_q31_t)value[INDEX_source_offset],
                                  .amplitude = (hyst_q31_t)value[INDEX_source_amplitude],
                                  .increment = value[INDEX_source_increment],
                                  .cycles = value[INDEX_source_cycles],
                                  .points = register_blocks_waveform(),
                                  .point_count = value[INDEX_waveform_points],
                                  .tones = register_blocks_tones(),
                                  .tone_count = value[INDEX_source_tones]};
    if (settings.kind == SOURCE_SWEEP &&
        !sweep_make(settings.increment, value[INDEX_sweep_increment], value[INDEX_sweep_samples],
                    (sweep_spacing_t)value[INDEX_sweep_spacing], &settings.sweep)) {
        settings.sweep.samples = 0;
    }
    return settings;
}

static capture_settings_t capture_settings(const uint32_t value[REGISTER_COUNT]) {
    return (capture_settings_t){.decimation = (uint16_t)value[INDEX_capture_decimation],
                                .length = (uint16_t)value[INDEX_capture_length],
                                .before = (uint16_t)value[INDEX_capture_before],
                                .signals = (uint16_t)value[INDEX_capture_signals],
                                .level = (int16_t)(uint16_t)(value[INDEX_capture_level] >> 16),
                                .trigger = (capture_trigger_t)value[INDEX_capture_trigger]};
}

static bool command_possible(const uint32_t value[REGISTER_COUNT]) {
    const source_settings_t settings = source_settings(value);
    const capture_settings_t capture = capture_settings(value);
    switch (value[INDEX_command]) {
    case COMMAND_COMMIT:
        return !loop_adoption_pending();
    case COMMAND_START:
        return loop_ready() && value[INDEX_mode] != HYST_MODE_PARK && !loop_conditioning() &&
               source_settings_valid(&settings) &&
               parameter_store_has_time_for(settings.kind == SOURCE_MULTISINE ? settings.tone_count : 0U);
    case COMMAND_CONDITION:
        return loop_armed();
    case COMMAND_ARM:
        return parameter_store_image_given() && !loop_in_fault() && health_watch_faults() == 0;
    case COMMAND_SAVE:
        return parameter_store_image_given() && loop_off();
    case COMMAND_SAVE_LINE:
        return loop_off() && parameter_store_leaves_time_for(value[INDEX_line_baud]);
    case COMMAND_ARM_CAPTURE:
        return capture_settings_valid(&capture);
    case COMMAND_NONE:
    case COMMAND_STOP:
    case COMMAND_DISARM:
    case COMMAND_CLEAR:
    case COMMAND_PARK:
    case COMMAND_LATCH:
    case COMMAND_END_CAPTURE:
        return true;
    default:
        return false;
    }
}

bool control_leaves_capture_readable(const uint32_t value[REGISTER_COUNT]) {
    switch (value[INDEX_command]) {
    case COMMAND_ARM_CAPTURE:
        return capture_readable_while_filled(&(capture_settings_t){.length = (uint16_t)value[INDEX_capture_length],
                                                                   .signals = (uint16_t)value[INDEX_capture_signals]});
    case COMMAND_END_CAPTURE:
        return true;
    default:
        return capture_readable();
    }
}

bool control_setting_valid(unsigned index, const uint32_t value[REGISTER_COUNT]) {
    const uint32_t x = value[index];
    const line_settings_t line = line_settings(value);
    switch (index) {
    case INDEX_command:
        return command_possible(value);
    case INDEX_mode:
        return x == HYST_MODE_PARK || (x <= HYST_MODE_COMPENSATE && loop_armed());
    case INDEX_source:
        return x <= SOURCE_MULTISINE;
    case INDEX_unlock:
        return x == 0 || x == CONTROL_KEY_PARAMETERS || x == CONTROL_KEY_OUTPUT;
    case INDEX_sweep_spacing:
        return x <= SWEEP_LOGARITHMIC;
    case INDEX_source_tones:
        return x <= SOURCE_TONES_MAX;
    case INDEX_waveform_points:
        return x <= WAVEFORM_CAPACITY;
    case INDEX_capture_decimation:
        return x > 0;
    case INDEX_capture_trigger:
        return x <= CAPTURE_AT_WARNING;
    case INDEX_capture_signals:
        return x > 0 && x <= CAPTURE_ALL;
    case INDEX_model_error_limit:
    case INDEX_current_limit:
        return (hyst_q31_t)x >= 0;
    case INDEX_setpoint_slew:
    case INDEX_reference_slew:
        return (hyst_q31_t)x > 0;
    case INDEX_drive_slew:
        return (hyst_q31_t)x >= board_info.fault_slew_min && (hyst_q31_t)x <= board_info.drive_slew_max;
    case INDEX_drive_low:
    case INDEX_drive_high:
        return loop_drive_limits_possible((hyst_q31_t)value[INDEX_drive_low], (hyst_q31_t)value[INDEX_drive_high]);
    case INDEX_reference_low:
    case INDEX_reference_high:
        return (hyst_q31_t)value[INDEX_reference_low] <= (hyst_q31_t)value[INDEX_reference_high];
    case INDEX_temperature_alert:
    case INDEX_temperature_trip:
        return (int32_t)x <= board_info.health.temperature_trip;
    case INDEX_supply_low:
        return (int32_t)x >= board_info.health.supply_low;
    case INDEX_supply_high:
        return (int32_t)x <= board_info.health.supply_high;
    case INDEX_high_voltage_low:
        return (int32_t)x >= board_info.health.high_voltage_low;
    case INDEX_high_voltage_high:
        return (int32_t)x <= board_info.health.high_voltage_high;
    case INDEX_health_looks:
        return x > 0 && x <= HEALTH_WATCH_LOOKS_MAX;
    case INDEX_line_address:
    case INDEX_line_baud:
    case INDEX_line_parity:
        return line_settings_valid(&line);
    default:
        return true;
    }
}

static void apply_health(const uint32_t value[REGISTER_COUNT]) {
    const board_health_limits_t limits = {.temperature_alert = (int32_t)value[INDEX_temperature_alert],
                                          .temperature_trip = (int32_t)value[INDEX_temperature_trip],
                                          .supply_low = (int32_t)value[INDEX_supply_low],
                                          .supply_high = (int32_t)value[INDEX_supply_high],
                                          .high_voltage_low = (int32_t)value[INDEX_high_voltage_low],
                                          .high_voltage_high = (int32_t)value[INDEX_high_voltage_high]};
    loop_set_health_limits(&limits, value[INDEX_health_looks]);
}

void control_apply(unsigned index, uint32_t value[REGISTER_COUNT]) {
    switch (index) {
    case INDEX_unlock:
        unlock(value, value[INDEX_unlock]);
        value[INDEX_unlock] = 0; /* write only */
        break;
    case INDEX_mode:
        loop_set_mode((hyst_mode_t)value[INDEX_mode]);
        break;
    case INDEX_setpoint:
        loop_set_setpoint((hyst_q31_t)value[INDEX_setpoint]);
        break;
    case INDEX_setpoint_slew:
        loop_set_setpoint_slew((hyst_q31_t)value[INDEX_setpoint_slew]);
        break;
    case INDEX_watchdog:
        loop_set_timeout(value[INDEX_watchdog]);
        break;
    case INDEX_current_limit:
        loop_set_current_limit((hyst_q31_t)value[INDEX_current_limit]);
        break;
    case INDEX_model_error_limit:
    case INDEX_model_error_time:
        loop_set_model_limit((hyst_q31_t)value[INDEX_model_error_limit], value[INDEX_model_error_time]);
        break;
    case INDEX_drive_slew:
        loop_set_drive_slew((hyst_q31_t)value[INDEX_drive_slew]);
        break;
    case INDEX_drive_low:
    case INDEX_drive_high:
        (void)loop_set_drive_limits((hyst_q31_t)value[INDEX_drive_low], (hyst_q31_t)value[INDEX_drive_high]);
        break;
    case INDEX_reference_low:
    case INDEX_reference_high:
    case INDEX_reference_slew:
        loop_set_reference_limit(&(reference_limit_t){.low = (hyst_q31_t)value[INDEX_reference_low],
                                                      .high = (hyst_q31_t)value[INDEX_reference_high],
                                                      .slew = (hyst_q31_t)value[INDEX_reference_slew]});
        break;
    case INDEX_temperature_alert:
    case INDEX_temperature_trip:
    case INDEX_supply_low:
    case INDEX_supply_high:
    case INDEX_high_voltage_low:
    case INDEX_high_voltage_high:
    case INDEX_health_looks:
        apply_health(value);
        break;
    case INDEX_stream_from:
        register_blocks_stream_from(value[INDEX_stream_from]);
        break;
    default: /* the others are looked at when a command or the main loop needs them */
        break;
    }
}

static void start(const uint32_t value[REGISTER_COUNT]) {
    const source_settings_t settings = source_settings(value);
    loop_start(&settings);
}

/* What the flash does not take is not in force either. */
static void save_line(const uint32_t value[REGISTER_COUNT]) {
    const line_settings_t line = line_settings(value);
    if (parameter_store_save_line(&line)) {
        modbus_server_change_line(&line);
        parameter_store_set_rate(line.baud);
    }
}

static void arm_capture(const uint32_t value[REGISTER_COUNT]) {
    const capture_settings_t settings = capture_settings(value);
    const uint32_t key = board_lock();
    capture_arm(&settings);
    board_unlock(key);
}

static void end_capture(void) {
    const uint32_t key = board_lock();
    capture_end();
    board_unlock(key);
}

/* Those that change what the amplifier does. */
static bool noteworthy(control_command_t command) {
    return command != COMMAND_NONE && command != COMMAND_LATCH && command != COMMAND_ARM_CAPTURE &&
           command != COMMAND_END_CAPTURE && command != COMMAND_COMMIT;
}

void control_execute(control_command_t command, uint32_t value[REGISTER_COUNT]) {
    if (noteworthy(command)) {
        event_log_add(EVENT_COMMAND, (uint16_t)command);
    }
    switch (command) {
    case COMMAND_NONE:
        break;
    case COMMAND_COMMIT:
        parameter_store_commit();
        event_log_add(EVENT_COMMIT, (uint16_t)parameter_store_status().fault.error);
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
    case COMMAND_ARM:
        (void)loop_arm(parameter_store_whole());
        break;
    case COMMAND_DISARM:
        loop_disarm();
        break;
    case COMMAND_SAVE:
        save(value);
        break;
    case COMMAND_END_CAPTURE:
        end_capture();
        break;
    case COMMAND_SAVE_LINE:
        save_line(value);
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
    value[INDEX_store_state] = status.stored;
    value[INDEX_store_sequence] = status.sequence;
    value[INDEX_image_cost] = status.cost;
    value[INDEX_cost_budget] = status.cost_budget;
    value[INDEX_events] = event_log_count();
}

void control_latch(uint32_t value[REGISTER_COUNT]) {
    telemetry_t t;
    telemetry_read(&t);
#define TELEMETRY(name, address, type, unit, text) value[INDEX_##name] = (uint32_t)t.name;
#include "registers/registers.def"
    const model_error_t error = model_watch_error();
    value[INDEX_model_error_rms] = (uint32_t)error.rms;
    value[INDEX_model_error_largest] = (uint32_t)error.largest;
    value[INDEX_model_error_slow] = (uint32_t)error.slow;
    value[INDEX_model_error_fast] = (uint32_t)error.fast;
    value[INDEX_model_error_blocks] = error.blocks;
    value[INDEX_capture_first] = capture_first();
    value[INDEX_current_average] = (uint32_t)loop_current_average();
    value[INDEX_temperature] = (uint32_t)health_watch_reading(HEALTH_TEMPERATURE);
    value[INDEX_supply] = (uint32_t)health_watch_reading(HEALTH_SUPPLY);
    value[INDEX_high_voltage] = (uint32_t)health_watch_reading(HEALTH_HIGH_VOLTAGE);
    const modbus_counters_t line = modbus_server_counters();
    value[INDEX_line_echoes] = line.echoes;
    value[INDEX_line_errors] = line.errors;
    value[INDEX_frames_served] = line.served;
}
