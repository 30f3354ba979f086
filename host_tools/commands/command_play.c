/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "amplifier/amplifier_image.h"
#include "amplifier/device/mode_names.h"
#include "amplifier/driving.h"
#include "amplifier/experiment.h"
#include "command_line/device_options.h"
#include "command_line/waveform_options.h"
#include "commands/command.h"
#include "compile/compile.h"
#include "recording/table/table.h"
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Register `watchdog`, in ms. */
#define MOST_SILENCE_S 65.0

typedef struct {
    device_options_t line;
    const char *path, *mode;
    waveform_options_t waveform; /* without a path */
    unsigned long passes;
    double silence_s;
    bool no_condition;
    hyst_mode_t played;
    table_t table;
    bool json;
} settings_t;

/* Time in s and level, the first two columns. */
static bool check_table(const table_t *table, failure_t *failure) {
    if (table->columns < 2 || table->rows < 2) {
        return fail(failure, "%s: not a table of times and levels: %zu columns, %zu rows", table->source,
                    table->columns, table->rows);
    }
    for (size_t i = 0; i < table->rows; i++) {
        const double time = table->column[0].value[i];
        if (!isfinite(time) || !isfinite(table->column[1].value[i]) ||
            (i > 0 && !(time > table->column[0].value[i - 1]))) {
            return fail(failure, "%s: row %zu: no number, or a time that is not after the one before", table->source,
                        i + 1);
        }
    }
    return true;
}

/* From the row before, rounded without drift. */
static double samples_to(const table_t *table, size_t row, double sample_rate_hz) {
    const double *time = table->column[0].value;
    return round((time[row] - time[0]) * sample_rate_hz) - round((time[row - 1] - time[0]) * sample_rate_hz);
}

static breakpoint_t *corners_of(const table_t *table, double sample_rate_hz) {
    breakpoint_t *corner = allocate(table->rows - 1, sizeof *corner);
    for (size_t i = 1; i < table->rows; i++) {
        corner[i - 1] = (breakpoint_t){.samples = (uint32_t)samples_to(table, i, sample_rate_hz),
                                       .level = table->column[1].value[i]};
    }
    return corner;
}

/* What may be played, and its unit. */
static const char *range_of(const hyst_parameters_t *image, hyst_mode_t mode, double range[2]) {
    const bool direct = mode == HYST_MODE_DIRECT;
    range[0] = direct ? drive_to_volts(image, image->drive_low) : position_to_micrometres(image, HYST_Q31_MIN);
    range[1] = direct ? drive_to_volts(image, image->drive_high) : position_to_micrometres(image, HYST_Q31_MAX);
    return direct ? "V" : "um";
}

static bool check_rows(const device_t *device, const hyst_parameters_t *image, const settings_t *s,
                       failure_t *failure) {
    const double sample_rate_hz = device_sample_rate_hz(device);
    double range[2];
    const char *unit = range_of(image, s->played, range);
    for (size_t i = 0; i < s->table.rows; i++) {
        const double level = s->table.column[1].value[i];
        if (level < range[0] || level > range[1]) {
            return fail(failure, "%s: row %zu: %g is outside of %g to %g %s", s->table.source, i + 1, level, range[0],
                        range[1], unit);
        }
        const double samples = i > 0 ? samples_to(&s->table, i, sample_rate_hz) : 1.0;
        if (samples > UINT32_MAX) {
            return fail(failure, "%s: row %zu: a line of more than %g s", s->table.source, i + 1,
                        UINT32_MAX / sample_rate_hz);
        }
        /* The amplifier would take it for a line of one sample, and play the table too slowly. */
        if (samples < 1.0) {
            return fail(failure, "%s: row %zu: the line to it has no sample, at %g samples per second", s->table.source,
                        i + 1, sample_rate_hz);
        }
    }
    return true;
}

/* corner: to be freed. */
static experiment_table_t table_of(const device_t *device, const settings_t *s, breakpoint_t **corner) {
    *corner = corners_of(&s->table, device_sample_rate_hz(device));
    return (experiment_table_t){.mode = s->played,
                                .condition = !s->no_condition,
                                .start = s->table.column[1].value[0],
                                .corner = *corner,
                                .corners = s->table.rows - 1,
                                .passes = s->passes};
}

static bool report(const settings_t *s, const waveform_t *waveform, failure_t *failure) {
    const bool table = s->path != NULL;
    if (s->json) {
        json_t *object = json_pack("{s:s, s:s, s:f}", "format", "hyst-play-1", "mode", mode_name(s->played),
                                   "silence_s", s->silence_s);
        json_object_set_new(object, table ? "table" : "waveform",
                            json_string(table ? s->table.source : waveform_name(waveform->kind)));
        if (table) {
            json_object_set_new(object, "points", json_integer((json_int_t)s->table.rows));
        }
        if (!json_print(object, JSON_INDENT(2), failure)) {
            return false;
        }
    }
    if (!text_wanted(s->json)) {
        return true;
    }
    if (table) {
        printf("%s plays: %zu points, read back the same", s->table.source, s->table.rows);
    } else {
        printf("%s plays at %g Hz", waveform_name(waveform->kind), waveform->frequency_hz);
    }
    printf(", mode %s; it parks after %g s without a request\n", mode_name(s->played), s->silence_s);
    return true;
}

typedef struct {
    const settings_t *settings;
    const hyst_parameters_t *image;
    const experiment_table_t *table; /* NULL: the experiment */
    const experiment_t *experiment;
} started_t;

static bool start(device_t *device, void *context, failure_t *failure) {
    const started_t *started = context;
    return started->table != NULL
               ? experiment_start_table(device, started->image, started->table, failure)
               : experiment_start(device, started->image, started->experiment, started->settings->passes, failure);
}

/* What can be said before the drive moves is. */
static bool drive(device_t *device, const settings_t *s, const hyst_parameters_t *image, const experiment_t *experiment,
                  failure_t *failure) {
    breakpoint_t *corner = NULL;
    experiment_table_t table;
    started_t started = {s, image, NULL, experiment};
    const driving_t driving = {.play = start, .context = &started, .silence_s = s->silence_s};
    if (s->path != NULL) {
        table = table_of(device, s, &corner);
        started.table = &table;
    }
    const bool good = (s->path != NULL ? experiment_check_table(device, &table, failure)
                                       : experiment_check_start(device, experiment, failure)) &&
                      driving_run(device, &driving, failure);
    free(corner);
    return good;
}

static bool play(device_t *device, const settings_t *s, failure_t *failure) {
    hyst_parameters_t image;
    double range[2];
    experiment_t experiment = {.mode = s->played, .condition = !s->no_condition};
    if (!amplifier_image_read(device, &image, failure)) {
        return false;
    }
    const char *unit = range_of(&image, s->played, range);
    if (s->path != NULL ? !check_rows(device, &image, s, failure)
                        : !waveform_make(&s->waveform, range, unit, &experiment.waveform, failure)) {
        return false;
    }
    device_print_left_fault(device);
    if (!drive(device, s, &image, &experiment, failure)) {
        return false;
    }
    const bool told = report(s, &experiment.waveform, failure) &&
                      (fflush(stdout) == 0 || reader_has_left() || fail(failure, "cannot write the result to stdout"));
    return told || fail_in(failure, "the amplifier plays on, and `hyst stop` ends it");
}

static int work(device_t *device, void *settings) {
    failure_t failure;
    return play(device, settings, &failure) ? STATUS_DONE : failure_print(&failure);
}

static int check(void *context) {
    settings_t *s = context;
    s->played = HYST_MODE_PARK;
    for (int mode = HYST_MODE_DIRECT; mode <= HYST_MODE_COMPENSATE; mode++) {
        s->played = strcmp(s->mode, mode_name(mode)) == 0 ? (hyst_mode_t)mode : s->played;
    }
    if (s->played == HYST_MODE_PARK) {
        return usage_error(&command_play, "--mode %s: not direct, linear or compensate", s->mode);
    }
    if (!(s->silence_s >= 0.1 && s->silence_s <= MOST_SILENCE_S)) {
        return usage_error(&command_play, "--silence %g: outside 0.1..%g s", s->silence_s, MOST_SILENCE_S);
    }
    if (s->passes > UINT32_MAX) {
        return usage_error(&command_play, "--passes %lu: at most %" PRIu32, s->passes, UINT32_MAX);
    }
    if ((s->path != NULL) == (s->waveform.name != NULL)) {
        return usage_error(&command_play, "either --table FILE or --waveform NAME");
    }
    return s->path != NULL ? OPTIONS_RUN : waveform_check(&command_play, &s->waveform);
}

static bool prepare(void *context, failure_t *failure) {
    settings_t *s = context;
    return s->path == NULL || (table_read(&s->table, s->path, failure) &&
                               (s->table.damage == NULL || fail(failure, "%s: %s", s->path, s->table.damage)) &&
                               check_table(&s->table, failure));
}

static int run(int argc, char **argv) {
    settings_t s = {
        .line = DEVICE_OPTIONS_DEFAULT, .mode = "compensate", .waveform = WAVEFORM_OPTIONS_DEFAULT, .silence_s = 5.0};
    s.waveform.cycles = 1; /* a pass */
    const option_t options[] = {
        DEVICE_OPTIONS(s.line),
        {"--table", NULL, OPTION_INPUT, "FILE", "times in s and levels, two columns", &s.path},
        WAVEFORM_SHAPE_OPTIONS(s.waveform, "LEVEL"),
        {"--mode", "-m", OPTION_TEXT, "direct|linear|compensate", "levels in V (direct) or um (compensate)", &s.mode},
        {"--passes", "-n", OPTION_COUNT, "N", "times to play it; 0, the default: until it is stopped", &s.passes},
        {"--silence", NULL, OPTION_NUMBER, "S", "it parks when no request comes for so long (5 s)", &s.silence_s},
        {"--no-condition", NULL, OPTION_FLAG, NULL, "do not sweep the drive range first", &s.no_condition},
        JSON_OPTION(&s.json),
    };
    const device_work_t job = {
        .settings = &s, .line = &s.line, .check = check, .prepare = prepare, .to_its_end = true, .work = work};
    const int status = device_command_run(&command_play, options, sizeof options / sizeof options[0], argc, argv, &job);
    table_free(&s.table);
    return status;
}

const command_t command_play = {
    .name = "play",
    .order = 112,
    .arguments = "--port DEV --table FILE|--waveform NAME",
    .summary = "Let the amplifier play a table or a waveform, and leave it playing",
    .details =
        "Sweeps the whole drive range once, goes to the first level, uploads the table and reads it back, and starts "
        "it.\n"
        "Between two points the reference is a straight line. The waveforms are those of `hyst record`. The amplifier\n"
        "goes on when this command has ended, as long as some master sends it a request at least every --silence\n"
        "seconds: `hyst watch` does, or `hyst monitor`. `hyst stop` ends it.",
    .run = run,
    .files = "FILE: any table of two columns, time in s and level; the first row is where it starts.\n",
    .examples = "# A pattern without end, watched over\n"
                "hyst play --port /dev/ttyUSB0 --table pattern.csv\n"
                "hyst watch --port /dev/ttyUSB0 --model model.json --report warnings\n"
                "# The same with sixteen tones up to 200 Hz\n"
                "hyst play --port /dev/ttyUSB0 --waveform multisine --frequency 2 --end-frequency 200\n"};
