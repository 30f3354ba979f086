/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "interface/info_run.h"
#include "amplifier/amplifier_image.h"
#include "amplifier/device/mode_names.h"
#include "compile/compile.h"
#include "compile/hysteresis_text.h"
#include <stdio.h>

/* Firmware that is older than these registers has no current to show. */
static void read_current(device_t *device, info_t *info) {
    failure_t ignored;
    if (!device_read(device, INDEX_capacitance, &info->now[INDEX_capacitance], &ignored) ||
        !device_read(device, INDEX_current_limit, &info->now[INDEX_current_limit], &ignored) ||
        !device_read(device, INDEX_current_peak, &info->now[INDEX_current_peak], &ignored) ||
        !device_read(device, INDEX_drive_slew, &info->now[INDEX_drive_slew], &ignored)) {
        info->now[INDEX_capacitance] = 0;
    }
}

bool info_read(device_t *device, info_t *info, failure_t *failure) {
    info->device = device;
    if (!amplifier_image_read(device, &info->image, failure) ||
        !device_read(device, INDEX_commits, &info->commits, failure) ||
        !device_read_telemetry(device, info->now, failure)) {
        return false;
    }
    read_current(device, info);
    return true;
}

const char *info_board(const info_t *info) {
    const char *name = board_name(device_identity(info->device, INDEX_board));
    return name != NULL ? name : "a board that this version does not know";
}

void info_version(const info_t *info, char text[INFO_VERSION_TEXT]) {
    const int64_t version = device_identity(info->device, INDEX_firmware_version);
    (void)snprintf(text, INFO_VERSION_TEXT, "%d.%d.%d", (int)(version >> 12), (int)(version >> 6 & 63),
                   (int)(version & 63));
}

double info_cost_us(const info_t *info, int which) {
    return 1e6 * (double)info->now[which] / (double)device_identity(info->device, INDEX_cost_rate);
}

double info_milliamperes(const info_t *info, int64_t step) {
    const double farads = 1e-12 * (double)info->now[INDEX_capacitance];
    const double volts = 1e-6 * info->image.drive_half_range_uv * (double)step / 2147483648.0;
    return 1e3 * farads * volts * device_sample_rate_hz(info->device);
}

double info_volts(const info_t *info, int64_t drive) {
    return drive_to_volts(&info->image, (hyst_q31_t)drive);
}

double info_micrometres(const info_t *info, int64_t position) {
    return position_to_micrometres(&info->image, (hyst_q31_t)position);
}

double info_reference(const info_t *info, const char **unit) {
    const bool direct = info->now[INDEX_active_mode] == HYST_MODE_DIRECT;
    *unit = direct ? "V" : "um";
    return direct ? info_volts(info, info->now[INDEX_reference]) : info_micrometres(info, info->now[INDEX_reference]);
}

static json_t *counters_json(const info_t *info) {
    static const int counters[] = {INDEX_samples,
#define COUNTER(name, address, note, text) INDEX_##name,
#include "registers/registers.def"
                                   INDEX_line_errors, INDEX_frames_served, INDEX_faults_sticky, INDEX_faults_live};
    json_t *object = json_object();
    for (size_t i = 0; i < sizeof counters / sizeof counters[0]; i++) {
        json_object_set_new(object, register_table[counters[i]].name, json_integer(info->now[counters[i]]));
    }
    json_object_set_new(object, "commits", json_integer(info->commits));
    return object;
}

static json_t *current_json(const info_t *info) {
    const int64_t *now = info->now;
    if (now[INDEX_capacitance] == 0) {
        return json_null();
    }
    const int64_t limit = now[INDEX_current_limit];
    return json_pack("{s:f, s:f, s:f, s:f, s:o}", "capacitance_f", 1e-12 * (double)now[INDEX_capacitance], "average_ma",
                     info_milliamperes(info, now[INDEX_current_average]), "peak_ma",
                     info_milliamperes(info, now[INDEX_current_peak]), "peak_limit_ma",
                     info_milliamperes(info, now[INDEX_drive_slew]), "limit_ma",
                     limit > 0 ? json_real(info_milliamperes(info, limit)) : json_null());
}

json_t *info_to_json(const info_t *info) {
    const hyst_parameters_t *image = &info->image;
    const device_t *device = info->device;
    const int64_t *now = info->now;
    char version[INFO_VERSION_TEXT];
    info_version(info, version);
    const char *unit = NULL;
    const double value = info_reference(info, &unit);
    json_t *identity =
        json_pack("{s:s, s:s, s:I, s:f, s:I, s:I, s:I, s:I}", "board", info_board(info), "firmware", version,
                  "register_map", (json_int_t)device_identity(device, INDEX_abi), "sample_rate_hz",
                  device_sample_rate_hz(device), "latency_samples", (json_int_t)device_identity(device, INDEX_latency),
                  "position_bits", (json_int_t)device_identity(device, INDEX_position_bits), "drive_bits",
                  (json_int_t)device_identity(device, INDEX_drive_bits), "capture_frames",
                  (json_int_t)device_identity(device, INDEX_capture_capacity));
    char serial[DEVICE_SERIAL_TEXT];
    device_serial(device, serial);
    json_object_set_new(identity, "serial", serial[0] != '\0' ? json_string(serial) : json_null());
    json_t *in_force = json_pack(
        "{s:I, s:i, s:I, s:s, s:I, s:I, s:I, s:I, s:I, s:I, s:I, s:[ff], s:[ff], s:f, s:[ff]}", "model_id",
        (json_int_t)image->model_id, "format", (int)HYST_IMAGE_VERSION, "lookahead_samples",
        (json_int_t)image->lookahead_samples, "hysteresis", hysteresis_name(image), "operators",
        (json_int_t)hysteresis_size(image), "drive_curves", (json_int_t)image->drive_curves, "reference_curves",
        (json_int_t)image->reference_curves, "shape_sections", (json_int_t)image->shape_sections, "inertia_sections",
        (json_int_t)image->inertia_sections, "equalise_sections", (json_int_t)image->equalise_sections, "creep_cells",
        (json_int_t)image->creep_cells, "drive_range_v", drive_to_volts(image, HYST_Q31_MIN),
        drive_to_volts(image, HYST_Q31_MAX), "drive_limits_v", drive_to_volts(image, image->drive_low),
        drive_to_volts(image, image->drive_high), "drive_park_v", drive_to_volts(image, image->drive_park),
        "position_range_um", position_to_micrometres(image, HYST_Q31_MIN),
        position_to_micrometres(image, HYST_Q31_MAX));
    json_t *state =
        json_pack("{s:s, s:s, s:s, s:f, s:s, s:f, s:f, s:f, s:f}", "mode", mode_name(now[INDEX_active_mode]), "state",
                  state_name(now[INDEX_state]), "amplifier_state", power_name(now[INDEX_amplifier_state]), "reference",
                  value, "reference_unit", unit, "drive_v", info_volts(info, now[INDEX_drive]), "position_um",
                  info_micrometres(info, now[INDEX_position]), "cost_max_us", info_cost_us(info, INDEX_cost_max),
                  "cost_last_us", info_cost_us(info, INDEX_cost_last));
    return json_pack("{s:s, s:o, s:o, s:o, s:o, s:o}", "format", "hyst-info-1", "amplifier", identity, "image",
                     in_force, "now", state, "counters", counters_json(info), "current", current_json(info));
}
