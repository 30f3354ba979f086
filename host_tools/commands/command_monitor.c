/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "amplifier/amplifier_image.h"
#include "amplifier/device/mode_names.h"
#include "amplifier/device/sample_number.h"
#include "base/json_output.h"
#include "base/monotonic_clock.h"
#include "base/stop_signal.h"
#include "command_line/device_options.h"
#include "commands/command.h"
#include "compile/compile.h"
#include <inttypes.h>
#include <stdio.h>

/* One snapshot in units. */
typedef struct {
    int64_t sequence;
    double time_s; /* of the loop's samples, since the first line */
    const char *mode, *state;
    bool direct;      /* the reference is a drive */
    bool follows;     /* the position shall be the reference */
    double reference; /* V if direct, else um */
    double drive_v, position_um;
} line_t;

static line_t line_of(const int64_t now[REGISTER_COUNT], const hyst_parameters_t *image, double time_s) {
    const hyst_q31_t reference = (hyst_q31_t)now[INDEX_reference];
    const int64_t mode = now[INDEX_active_mode];
    const bool direct = mode == HYST_MODE_DIRECT;
    return (line_t){.sequence = now[INDEX_sequence],
                    .time_s = time_s,
                    .mode = mode_name(mode),
                    .state = state_name(now[INDEX_state]),
                    .direct = direct,
                    .follows = mode == HYST_MODE_LINEAR || mode == HYST_MODE_COMPENSATE,
                    .reference = direct ? drive_to_volts(image, reference) : position_to_micrometres(image, reference),
                    .drive_v = drive_to_volts(image, (hyst_q31_t)now[INDEX_drive]),
                    .position_um = position_to_micrometres(image, (hyst_q31_t)now[INDEX_position])};
}

static void print_header(void) {
    printf("%10s  %-10s  %-12s  %14s  %12s  %14s  %12s\n", "time [s]", "mode", "state", "reference", "drive [V]",
           "position [um]", "error [um]");
}

static bool print_line(const line_t *line, failure_t *failure) {
    printf("%10.4f  %-10s  %-12s  %11.4f %-2s  %12.4f  %14.4f  ", line->time_s, line->mode, line->state,
           line->reference, line->direct ? "V" : "um", line->drive_v, line->position_um);
    if (line->follows) {
        printf("%12.4f\n", line->position_um - line->reference);
    } else {
        printf("%12s\n", "-");
    }
    return fflush(stdout) == 0 || fail(failure, "cannot write the result to stdout");
}

static json_t *line_to_json(const line_t *line) {
    return json_pack("{s:I, s:f, s:s, s:s, s:f, s:s, s:f, s:f}", "sequence", (json_int_t)line->sequence, "time_s",
                     line->time_s, "mode", line->mode, "state", line->state, "reference", line->reference,
                     "reference_unit", line->direct ? "V" : "um", "drive_v", line->drive_v, "position_um",
                     line->position_um);
}

static bool show(const line_t *line, bool json, failure_t *failure) {
    return (!json || json_print_line(line_to_json(line), failure)) && (!text_wanted(json) || print_line(line, failure));
}

/* count 0: until a signal, or until its reader has seen enough. */
static bool monitor(device_t *device, double interval_s, unsigned long count, bool json, failure_t *failure) {
    hyst_parameters_t image;
    if (!amplifier_image_read(device, &image, failure)) {
        return false;
    }
    int64_t model_id = image.model_id;
    const volatile sig_atomic_t *stop = stop_on_signal();
    const double start_s = monotonic_s();
    double samples = 0.0; /* since the first line */
    int64_t last = 0;
    if (text_wanted(json)) {
        print_header();
    }
    for (unsigned long i = 0; !*stop && (count == 0 || i < count); i++) {
        int64_t now[REGISTER_COUNT];
        int64_t active_id = 0;
        if (!device_read_telemetry(device, now, failure) ||
            !device_read(device, INDEX_active_model_id, &active_id, failure)) {
            return false;
        }
        if (active_id != model_id) { /* the scales were changed in between */
            if (!amplifier_image_read(device, &image, failure)) {
                return false;
            }
            model_id = active_id;
        }
        const int64_t passed = i > 0 ? samples_between(last, now[INDEX_sequence]) : 0;
        if (passed < 0) {
            (void)fputs("note: the amplifier restarted; how long it was away is not in the time\n", stderr);
        }
        samples += passed > 0 ? (double)passed : 0.0;
        last = now[INDEX_sequence];
        const line_t line = line_of(now, &image, samples / device_sample_rate_hz(device));
        if (!show(&line, json, failure)) {
            return reader_has_left();
        }
        if (count == 0 || i + 1 < count) {
            sleep_until(start_s + interval_s * (double)(i + 1));
        }
    }
    return true;
}

typedef struct {
    device_options_t port;
    double interval_s;
    unsigned long count;
    bool json;
} settings_t;

static int check(void *settings) {
    const settings_t *s = settings;
    return s->interval_s >= 0.0 && s->interval_s <= 86400.0
               ? OPTIONS_RUN
               : usage_error(&command_monitor, "--interval %g: outside 0..86400 s", s->interval_s);
}

static int work(device_t *device, void *settings) {
    const settings_t *s = settings;
    failure_t failure;
    return monitor(device, s->interval_s, s->count, s->json, &failure) ? STATUS_DONE : failure_print(&failure);
}

static int run(int argc, char **argv) {
    settings_t s = {.port = DEVICE_OPTIONS_DEFAULT, .interval_s = 0.5};
    const option_t options[] = {
        DEVICE_OPTIONS(s.port),
        {"--interval", "-i", OPTION_NUMBER, "S", "time between lines (0.5 s)", &s.interval_s},
        {"--count", "-n", OPTION_COUNT, "N", "lines to print; 0, the default: until stopped", &s.count},
        JSON_OPTION(&s.json),
    };
    const device_work_t job = {.settings = &s, .line = &s.port, .check = check, .work = work};
    return device_command_run(&command_monitor, options, sizeof options / sizeof options[0], argc, argv, &job);
}

const command_t command_monitor = {
    .name = "monitor",
    .order = 90,
    .arguments = "--port DEV",
    .summary = "Show telemetry of the amplifier, line by line",
    .details = "Reference, drive and position of a line belong to the same sample. Ends cleanly on Ctrl-C.",
    .run = run,
    .examples = "# Ten lines, one a second\n"
                "hyst monitor --port /dev/ttyUSB0 --interval 1 --count 10\n"};
