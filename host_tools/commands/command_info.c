/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "amplifier/device/mode_names.h"
#include "base/json_output.h"
#include "command_line/device_options.h"
#include "commands/command.h"
#include "compile/compile.h"
#include "compile/hysteresis_text.h"
#include "interface/info_run.h"
#include <inttypes.h>
#include <stdio.h>

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

static void print_current(const info_t *info) {
    const int64_t *now = info->now;
    if (now[INDEX_capacitance] == 0) {
        return;
    }
    printf("current     average %.3g mA, peak %.3g mA of %.3g mA, into %g uF",
           info_milliamperes(info, now[INDEX_current_average]), info_milliamperes(info, now[INDEX_current_peak]),
           info_milliamperes(info, now[INDEX_drive_slew]), 1e-6 * (double)now[INDEX_capacitance]);
    if (now[INDEX_current_limit] > 0) {
        printf("; trips above %.3g mA on average", info_milliamperes(info, now[INDEX_current_limit]));
    }
    printf("\n");
}

static void print(const info_t *info) {
    const int64_t *now = info->now;
    char version[INFO_VERSION_TEXT];
    info_version(info, version);
    char serial[DEVICE_SERIAL_TEXT];
    device_serial(info->device, serial);
    printf("amplifier   %s, firmware %s, register map %" PRId64 "%s%s\n", info_board(info), version,
           device_identity(info->device, INDEX_abi), serial[0] != '\0' ? ", serial number " : "", serial);
    printf("loop        %g Hz, latency %" PRId64 " samples, converters: position %" PRId64 " bit, drive %" PRId64
           " bit\n",
           device_sample_rate_hz(info->device), device_identity(info->device, INDEX_latency),
           device_identity(info->device, INDEX_position_bits), device_identity(info->device, INDEX_drive_bits));
    print_image(&info->image);
    const char *unit = NULL;
    const double value = info_reference(info, &unit);
    printf("now         amplifier %s, %s, %s: reference %.4f %s, drive %.4f V, position %.4f um\n",
           power_name(now[INDEX_amplifier_state]), mode_name(now[INDEX_active_mode]), state_name(now[INDEX_state]),
           value, unit, info_volts(info, now[INDEX_drive]), info_micrometres(info, now[INDEX_position]));
    print_current(info);
    char live[FAULTS_TEXT], sticky[FAULTS_TEXT];
    printf("faults      now: %s; since start or clear: %s\n", faults_text(now[INDEX_faults_live], live),
           faults_text(now[INDEX_faults_sticky], sticky));
    printf("samples     %" PRId64 ": %" PRId64 " late, %" PRId64 " without a conversion, %" PRId64
           " at a drive limit, %" PRId64 " unreachable, %" PRId64 " with a filter saturated\n",
           now[INDEX_samples], now[INDEX_overruns], now[INDEX_converter_timeouts], now[INDEX_drive_limited],
           now[INDEX_unreachable], now[INDEX_filter_saturated]);
    printf("cost        worst %.2f us, last %.2f us a sample\n", info_cost_us(info, INDEX_cost_max),
           info_cost_us(info, INDEX_cost_last));
    printf("modbus      %" PRId64 " requests answered, %" PRId64 " frames dropped; %" PRId64 " images accepted\n",
           now[INDEX_frames_served], now[INDEX_line_errors], info->commits);
}

typedef struct {
    device_options_t line;
    bool json;
} settings_t;

static int work(device_t *device, void *settings) {
    failure_t failure;
    info_t info;
    bool ok = info_read(device, &info, &failure);
    const bool json = ((const settings_t *)settings)->json;
    ok = ok && (!json || json_print(info_to_json(&info), JSON_INDENT(2), &failure));
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
