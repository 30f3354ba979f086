/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "amplifier/amplifier_image.h"
#include "amplifier/mode_names.h"
#include "base/json_output.h"
#include "commands/command.h"
#include "commands/device_options.h"
#include "compile/compile.h"
#include "compile/hysteresis_text.h"
#include <inttypes.h>
#include <stdio.h>

/* What the command knows about an amplifier. */
typedef struct {
    const device_t *device;
    hyst_parameters_t image;
    int64_t commits;
    int64_t now[REGISTER_COUNT]; /* telemetry */
} info_t;

static const char *board_text(int64_t board) {
    const char *name = board_name(board);
    return name != NULL ? name : "a board that this version does not know";
}

static void version_text(int64_t version, char text[24]) {
    (void)snprintf(text, 24, "%d.%d.%d", (int)(version >> 12), (int)(version >> 6 & 63), (int)(version & 63));
}

/* Microseconds of a loop cost. */
static double cost_us(const info_t *info, int which) {
    return 1e6 * (double)info->now[which] / (double)device_identity(info->device, INDEX_cost_rate);
}

static double volts(const info_t *info, int64_t drive) {
    return drive_to_volts(&info->image, (hyst_q31_t)drive);
}

static double micrometres(const info_t *info, int64_t position) {
    return position_to_micrometres(&info->image, (hyst_q31_t)position);
}

/* The reference is a drive in direct mode. */
static double reference(const info_t *info, const char **unit) {
    const bool direct = info->now[INDEX_active_mode] == HYST_MODE_DIRECT;
    *unit = direct ? "V" : "um";
    return direct ? volts(info, info->now[INDEX_reference]) : micrometres(info, info->now[INDEX_reference]);
}

static void print_faults(int64_t faults, const char *none) {
    static const char *const names[] = {
        "overrun",        "converter timeout",        "communication timeout", "clock fallback",     "overload",
        "supply too low", "average current too high", "temperature",           "supply of the stage"};
    bool any = false;
    for (unsigned bit = 0; bit < sizeof names / sizeof names[0]; bit++) {
        if ((faults >> bit & 1) != 0) {
            printf("%s%s", any ? ", " : "", names[bit]);
            any = true;
        }
    }
    printf("%s", any ? "" : none);
}

static void print_image(const hyst_parameters_t *image) {
    printf("image       model 0x%08" PRIX32 ", format %u, made for %g Hz, lookahead %" PRIu32 " samples\n",
           image->model_id, HYST_IMAGE_VERSION, (double)image->sample_rate_mhz / 1000.0, image->lookahead_samples);
    char hysteresis[120];
    hysteresis_text(image, hysteresis);
    printf("            %s\n", hysteresis);
    printf("            filters: %" PRIu32 " shape, %" PRIu32 " inertia, %" PRIu32 " equalise sections; %" PRIu32
           " creep cells%s%s\n",
           image->shape_sections, image->inertia_sections, image->equalise_sections, image->creep_cells,
           image->drive_curves > 0 ? "; a drive curve" : "", image->reference_curves > 0 ? "; a reference curve" : "");
    printf("drive       converter %g..%g V, limits %g..%g V, parks at %g V\n", drive_to_volts(image, HYST_Q31_MIN),
           drive_to_volts(image, HYST_Q31_MAX), drive_to_volts(image, image->drive_low),
           drive_to_volts(image, image->drive_high), drive_to_volts(image, image->drive_park));
    printf("position    converter %g..%g um\n", position_to_micrometres(image, HYST_Q31_MIN),
           position_to_micrometres(image, HYST_Q31_MAX));
}

static void print(const info_t *info) {
    const int64_t *now = info->now;
    char version[24];
    version_text(device_identity(info->device, INDEX_firmware_version), version);
    char serial[DEVICE_SERIAL_TEXT];
    device_serial(info->device, serial);
    printf("amplifier   %s, firmware %s, register map %" PRId64 "%s%s\n",
           board_text(device_identity(info->device, INDEX_board)), version, device_identity(info->device, INDEX_abi),
           serial[0] != '\0' ? ", serial number " : "", serial);
    printf("loop        %g Hz, latency %" PRId64 " samples, converters: position %" PRId64 " bit, drive %" PRId64
           " bit\n",
           device_sample_rate_hz(info->device), device_identity(info->device, INDEX_latency),
           device_identity(info->device, INDEX_position_bits), device_identity(info->device, INDEX_drive_bits));
    print_image(&info->image);
    const char *unit = NULL;
    const double value = reference(info, &unit);
    printf("now         amplifier %s, %s, %s: reference %.4f %s, drive %.4f V, position %.4f um\n",
           power_name(now[INDEX_amplifier_state]), mode_name(now[INDEX_active_mode]), state_name(now[INDEX_state]),
           value, unit, volts(info, now[INDEX_drive]), micrometres(info, now[INDEX_position]));
    printf("faults      now: ");
    print_faults(now[INDEX_faults_live], "none");
    printf("; since start or clear: ");
    print_faults(now[INDEX_faults_sticky], "none");
    printf("\nsamples     %" PRId64 ": %" PRId64 " late, %" PRId64 " without a conversion, %" PRId64
           " at a drive limit, %" PRId64 " unreachable, %" PRId64 " with a filter saturated\n",
           now[INDEX_samples], now[INDEX_overruns], now[INDEX_converter_timeouts], now[INDEX_drive_limited],
           now[INDEX_unreachable], now[INDEX_filter_saturated]);
    printf("cost        worst %.2f us, last %.2f us a sample\n", cost_us(info, INDEX_cost_max),
           cost_us(info, INDEX_cost_last));
    printf("modbus      %" PRId64 " requests answered, %" PRId64 " frames dropped; %" PRId64 " images accepted\n",
           now[INDEX_frames_served], now[INDEX_line_errors], info->commits);
}

static json_t *counters_json(const info_t *info) {
    static const int counters[] = {INDEX_samples,
#define COUNTER(name, address, note, text) INDEX_##name,
#include "registers.def"
                                   INDEX_line_errors, INDEX_frames_served, INDEX_faults_sticky, INDEX_faults_live};
    json_t *object = json_object();
    for (size_t i = 0; i < sizeof counters / sizeof counters[0]; i++) {
        json_object_set_new(object, register_table[counters[i]].name, json_integer(info->now[counters[i]]));
    }
    json_object_set_new(object, "commits", json_integer(info->commits));
    return object;
}

static json_t *to_json(const info_t *info) {
    const hyst_parameters_t *image = &info->image;
    const device_t *device = info->device;
    const int64_t *now = info->now;
    char version[24];
    version_text(device_identity(device, INDEX_firmware_version), version);
    const char *unit = NULL;
    const double value = reference(info, &unit);
    json_t *identity =
        json_pack("{s:s, s:s, s:I, s:f, s:I, s:I, s:I, s:I}", "board", board_text(device_identity(device, INDEX_board)),
                  "firmware", version, "register_map", (json_int_t)device_identity(device, INDEX_abi), "sample_rate_hz",
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
                  value, "reference_unit", unit, "drive_v", volts(info, now[INDEX_drive]), "position_um",
                  micrometres(info, now[INDEX_position]), "cost_max_us", cost_us(info, INDEX_cost_max), "cost_last_us",
                  cost_us(info, INDEX_cost_last));
    return json_pack("{s:s, s:o, s:o, s:o, s:o}", "format", "hyst-info-1", "amplifier", identity, "image", in_force,
                     "now", state, "counters", counters_json(info));
}

typedef struct {
    device_options_t line;
    bool json;
} settings_t;

static int work(device_t *device, void *settings) {
    failure_t failure;
    info_t info = {.device = device};
    bool ok = amplifier_image_read(device, &info.image, &failure) &&
              device_read(device, INDEX_commits, &info.commits, &failure) &&
              device_read_telemetry(device, info.now, &failure);
    const bool json = ((const settings_t *)settings)->json;
    ok = ok && (!json || json_print(to_json(&info), JSON_INDENT(2), &failure));
    if (ok && text_wanted(json)) {
        print(&info);
    }
    return ok ? STATUS_DONE : failure_print(&failure);
}

static int run(int argc, char **argv) {
    settings_t s = {.line = DEVICE_OPTIONS_DEFAULT};
    const option_t options[] = {
        DEVICE_OPTIONS(s.line),
        JSON_OPTION(&s.json),
    };
    const device_work_t job = {.settings = &s, .line = &s.line, .work = work};
    return device_command_run(&command_info, options, sizeof options / sizeof options[0], argc, argv, &job);
}

const command_t command_info = {.name = "info",
                                .order = 80,
                                .arguments = "--port DEV",
                                .summary = "Show the amplifier, the image in force, the faults and the counters",
                                .details = "Volts and micrometres come from the scales of the image in force. Without "
                                           "an image the amplifier holds a neutral\n"
                                           "one, in which 1 V and 1 um stand for half of a converter's range.",
                                .run = run,
                                .examples = "# Which firmware and image, which fault, how many overruns\n"
                                            "hyst info --port /dev/ttyUSB0\n"
                                            "# The same for programs\n"
                                            "hyst info --port /dev/ttyUSB0 --json\n"};
