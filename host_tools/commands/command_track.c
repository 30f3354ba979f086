/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "amplifier/device/mode_names.h"
#include "base/output_file.h"
#include "command_line/device_options.h"
#include "command_line/waveform_options.h"
#include "commands/command.h"
#include "interface/track_run.h"
#include "recording/recording_hdf5.h"
#include "recording/reserved_output.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

typedef struct {
    device_options_t line;
    waveform_options_t waveform;
    const char *mode;
    bool both, no_condition, json;
    unsigned long frames;
    const char *output;
    reserved_output_t file[TRACK_MOST]; /* of that name, or of the two that it becomes */
} settings_t;

static void print_track(const track_t *track, const waveform_t *w) {
    const recording_t *r = &track->recording;
    const error_measure_t *e = &track->error;
    const error_budget_t *b = &track->budget;
    char text[120];
    waveform_describe(w, text);
    printf("%s, %s: %s, %.4g um peak to peak, %zu frames at %g Hz\n", waveform_name(w->kind), mode_name(track->mode),
           text, track->peak_to_peak_um, r->samples, r->sample_rate_hz);
    printf("  worst  %10.4f um at %.4f s (%.3f %%)\n", e->max_um, (double)e->max_sample / r->sample_rate_hz,
           100.0 * e->max_um / track->peak_to_peak_um);
    printf("  RMS    %10.4f um, NRMSE %.4f %%\n", e->rms_um, e->nrmse_percent);
    printf("  of which offset and gain %.4f um, delay %.4f um (%.1f us), noise %.4f um, rest %.4f um\n", b->static_um,
           b->delay_um, 1e6 * b->delay_s, b->noise_um, b->rest_um);
}

static bool report(const track_t *tracks, size_t count, const waveform_t *w, bool json, failure_t *failure) {
    if (json) {
        const bool good = json_print(tracks_to_json(tracks, count, w), JSON_INDENT(2), failure);
        if (!good || !text_wanted(true)) {
            return good;
        }
    }
    for (size_t i = 0; i < count; i++) {
        print_track(&tracks[i], w);
    }
    if (count == 2) {
        const double gain = track_ratio(&tracks[0], &tracks[1]);
        printf("NRMSE %.4f %% before, %.4f %% after", tracks[0].error.nrmse_percent, tracks[1].error.nrmse_percent);
        if (isfinite(gain)) {
            printf(": %.1f times less", gain);
        }
        putchar('\n');
    }
    return true;
}

typedef struct {
    char text[4096];
} output_path_t;

/* With two tracks OUT.csv becomes OUT-linear.csv and OUT-compensate.csv. */
static bool output_path(const settings_t *settings, hyst_mode_t mode, output_path_t *path, failure_t *failure) {
    const size_t length = strlen(settings->output);
    const char *dot = strrchr(settings->output, '.');
    const bool ends = dot != NULL && (strcmp(dot, ".csv") == 0 || hdf5_is_named(settings->output));
    const size_t stem = ends ? (size_t)(dot - settings->output) : length;
    const int written = settings->both ? snprintf(path->text, sizeof path->text, "%.*s-%s%s", (int)stem,
                                                  settings->output, mode_name(mode), ends ? dot : ".csv")
                                       : snprintf(path->text, sizeof path->text, "%s", settings->output);
    return (written >= 0 && (size_t)written < sizeof path->text) ||
           fail(failure, "%s: name too long", settings->output);
}

static bool check_outputs(void *context, failure_t *failure) {
    const settings_t *settings = context;
    output_path_t linear, compensate;
    return settings->output == NULL || (output_path(settings, HYST_MODE_LINEAR, &linear, failure) &&
                                        output_path(settings, HYST_MODE_COMPENSATE, &compensate, failure) &&
                                        output_files_check((const char *[]){linear.text, compensate.text},
                                                           settings->both ? 2 : 1, NULL, 0, failure));
}

/* The second file is that of the second of two tracks. */
static size_t file_of(const settings_t *settings, hyst_mode_t mode) {
    return settings->both && mode == HYST_MODE_COMPENSATE ? 1 : 0;
}

/* While the run is guarded: a file that cannot be written parks the amplifier. */
static bool take(void *context, const track_t *track, failure_t *failure) {
    settings_t *settings = context;
    experiment_print_events(&track->events);
    return reserved_output_write(&settings->file[file_of(settings, track->mode)], &track->recording, failure);
}

static void close_files(settings_t *settings) {
    reserved_output_close(&settings->file[0]);
    reserved_output_close(&settings->file[1]);
}

/* path: of the two, as long as the run. */
static bool open_files(settings_t *settings, const device_t *device, const track_options_t *options,
                       output_path_t path[TRACK_MOST], failure_t *failure) {
    const size_t rows = experiment_rows_most(device, settings->frames, false);
    bool good = true;
    for (size_t i = 0; good && i < options->count && settings->output != NULL; i++) {
        reserved_output_t *const file = &settings->file[file_of(settings, options->mode[i])];
        good = output_path(settings, options->mode[i], &path[i], failure) &&
               reserved_output_open(file, path[i].text, rows, failure);
    }
    if (!good) {
        close_files(settings);
    }
    return good;
}

/* Returns the exit status. */
static int track(device_t *device, void *context) {
    settings_t *settings = context;
    failure_t failure;
    waveform_t waveform;
    track_t tracks[TRACK_MOST];
    output_path_t path[TRACK_MOST];
    bool usage;
    const bool compensate = !settings->both && strcmp(settings->mode, mode_name(HYST_MODE_COMPENSATE)) == 0;
    const track_options_t options = {
        .waveform = settings->waveform,
        .count = settings->both ? 2 : 1,
        .mode = {compensate ? HYST_MODE_COMPENSATE : HYST_MODE_LINEAR, HYST_MODE_COMPENSATE},
        .no_condition = settings->no_condition,
        .frames = settings->frames,
        .take = take,
        .context = settings};
    if (!open_files(settings, device, &options, path, &failure)) {
        return failure_print(&failure);
    }
    device_print_left_fault(device);
    const bool ran = track_run(device, &options, &waveform, tracks, &usage, &failure);
    close_files(settings);
    if (!ran) {
        return usage ? usage_error(&command_track, "%s", failure.text) : failure_print(&failure);
    }
    const bool good = report(tracks, options.count, &waveform, settings->json, &failure);
    tracks_free(tracks, options.count);
    return good ? STATUS_DONE : failure_print(&failure);
}

static int check(void *context) {
    const settings_t *settings = context;
    const int status = waveform_check(&command_track, &settings->waveform);
    if (status != OPTIONS_RUN) {
        return status;
    }
    if (settings->both && settings->output != NULL && strncmp(settings->output, "/dev/fd/", 8) == 0) {
        return usage_error(&command_track, "--both makes two recordings: give -o the name of a file");
    }
    if (settings->both == (settings->mode != NULL)) {
        return usage_error(&command_track, "either --mode linear, --mode compensate or --both");
    }
    if (!settings->both && strcmp(settings->mode, mode_name(HYST_MODE_LINEAR)) != 0 &&
        strcmp(settings->mode, mode_name(HYST_MODE_COMPENSATE)) != 0) {
        return usage_error(&command_track, "--mode %s: not linear or compensate", settings->mode);
    }
    return OPTIONS_RUN;
}

static int run(int argc, char **argv) {
    settings_t s = {.line = DEVICE_OPTIONS_DEFAULT, .waveform = WAVEFORM_OPTIONS_DEFAULT};
    const option_t options[] = {
        DEVICE_OPTIONS(s.line),
        WAVEFORM_OPTIONS(s.waveform, "UM"),
        {"--mode", "-m", OPTION_TEXT, "linear|compensate", "linear (no model) or compensate", &s.mode},
        {"--both", NULL, OPTION_FLAG, NULL, "linear first, then compensate, and compare", &s.both},
        {"--no-condition", NULL, OPTION_FLAG, NULL, "do not sweep the drive range first", &s.no_condition},
        {"--frames", NULL, OPTION_COUNT, "N",
         "rows of the recording at most: fewer are read sooner; 0, the default: as many as it holds", &s.frames},
        {"--output", "-o", OPTION_OUTPUT, "CSV",
         "recording to write; with --both two, named CSV-linear and CSV-compensate", &s.output},
        JSON_OPTION(&s.json),
    };
    const device_work_t job = {
        .settings = &s, .line = &s.line, .check = check, .prepare = check_outputs, .to_its_end = true, .work = track};
    return device_command_run(&command_track, options, sizeof options / sizeof options[0], argc, argv, &job);
}

const command_t command_track = {
    .name = "track",
    .order = 110,
    .arguments = "--port DEV --waveform NAME --mode MODE",
    .summary = "Let the amplifier follow a reference, and measure the error",
    .details =
        "Sweeps the whole drive range once, goes to the start of the reference, plays it and captures reference and\n"
        "position of the same instants. NRMSE is the RMS of position - reference over the reference's peak to peak; "
        "the\n"
        "whole capture counts, from the first sample on. The waveforms are those of `hyst record`.",
    .run = run,
    .files = FILE_RECORDING,
    .examples = "# Before and after, in one go\n"
                "hyst track --port /dev/ttyUSB0 --waveform sine --frequency 10 --both\n"
                "# One mode, 20 um peak to peak, with the recording\n"
                "hyst track --port /dev/ttyUSB0 --waveform triangle --amplitude 10 --mode compensate -o track.csv\n"};
