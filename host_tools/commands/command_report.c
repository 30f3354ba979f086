/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "base/output_file.h"
#include "base/provenance.h"
#include "command_line/recording_input.h"
#include "commands/command.h"
#include "report/report.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Splits "NAME=BEFORE,AFTER" in place. */
static bool split_track(char *argument, const char **before, const char **after) {
    char *equals = strchr(argument, '=');
    char *comma = equals == NULL ? NULL : strchr(equals, ',');
    if (comma == NULL || equals == argument) {
        return false;
    }
    *equals = '\0';
    *comma = '\0';
    *before = equals + 1;
    *after = comma + 1;
    return true;
}

static bool write_report(const report_t *report, const char *path, bool json, failure_t *failure) {
    if (!report_write_html(report, path, failure)) {
        return false;
    }
    if (json && !json_print(report_to_json(report), JSON_INDENT(2), failure)) {
        return false;
    }
    if (text_wanted(json)) {
        report_print(stdout, report);
    }
    return true;
}

typedef struct {
    const char *output, *picture, *simulated, *diagnosis, *title;
    bool json;
} settings_t;

/* What the track's argument names. */
typedef struct {
    const char *name, *file[2]; /* before, after */
} track_argument_t;

static bool read_tracks(report_t *report, const track_argument_t *track, size_t tracks, failure_t *failure) {
    while (report->tracks < tracks) {
        const track_argument_t *const t = &track[report->tracks];
        if (!report_track_read(&report->track[report->tracks], t->name, t->file[0], t->file[1], failure)) {
            return false;
        }
        report->tracks++;
    }
    return true;
}

static bool make_report(const settings_t *settings, const char *model_path, const char *recording_path,
                        const track_argument_t *track, size_t tracks, failure_t *failure) {
    model_t model;
    if (!model_read(&model, model_path, failure)) {
        return false;
    }
    recording_t recording;
    if (!read_recording_aloud(&recording, recording_path, failure)) {
        model_free(&model);
        return false;
    }
    report_t report = {.model = &model,
                       .recording = &recording,
                       .simulated = settings->simulated,
                       .track = allocate(tracks, sizeof *report.track)};
    bool good =
        settings->diagnosis == NULL || (report.diagnosis = report_diagnosis_read(settings->diagnosis, failure)) != NULL;
    good = good && read_tracks(&report, track, tracks, failure) && report_check_modes(&report, failure) &&
           (settings->picture == NULL || report_write_picture(&report, settings->picture, failure)) &&
           write_report(&report, settings->output, settings->json, failure);
    for (size_t i = 0; i < report.tracks; i++) {
        report_track_free(&report.track[i]);
    }
    free(report.track);
    json_decref(report.diagnosis);
    recording_free(&recording);
    model_free(&model);
    return good;
}

/* The files that the arguments of tracks name are inputs, too. */
static bool check_files(const settings_t *settings, const track_argument_t *track, size_t tracks, failure_t *failure) {
    const char *const output[] = {settings->output, settings->picture};
    for (size_t i = 0; i < tracks; i++) {
        if (!output_files_check(output, 2, track[i].file, 2, failure)) {
            return false;
        }
    }
    return true;
}

static int run(int argc, char **argv) {
    settings_t s = {.output = "report.html"};
    const option_t options[] = {
        {"--output", "-o", OPTION_OUTPUT, "FILE", "page to write (report.html)", &s.output},
        {"--picture", NULL, OPTION_OUTPUT, "FILE.svg", "error traces as a separate picture", &s.picture},
        {"--simulated", NULL, OPTION_TEXT, "TEXT", "say that the tracks were simulated, and how", &s.simulated},
        {"--title", NULL, OPTION_TEXT, "TEXT", "heading of the page, for a lab book", &s.title},
        {"--diagnosis", NULL, OPTION_INPUT, "F.json",
         "BEFORE and AFTER are compensated both, and this diagnosis lies between them", &s.diagnosis},
        JSON_OPTION(&s.json),
    };
    size_t arguments = 0;
    int status = options_parse(&command_report, options, sizeof options / sizeof options[0], argc, argv, 3,
                               (size_t)argc, &arguments);
    if (status != OPTIONS_RUN) {
        return status;
    }
    provenance_set_title(s.title);
    const size_t tracks = arguments - 2;
    track_argument_t *track = allocate(tracks, sizeof *track);
    for (size_t i = 0; i < tracks && status == OPTIONS_RUN; i++) {
        char *const argument = argv[i + 3];
        track[i].name = argument;
        if (!split_track(argument, &track[i].file[0], &track[i].file[1])) {
            status = usage_error(&command_report, "'%s' is not NAME=BEFORE.csv,AFTER.csv", argument);
        } else {
            provenance_add_file(track[i].file[0]);
            provenance_add_file(track[i].file[1]);
        }
    }
    if (status == OPTIONS_RUN) {
        failure_t failure;
        const bool good =
            check_files(&s, track, tracks, &failure) && make_report(&s, argv[1], argv[2], track, tracks, &failure);
        status = good ? STATUS_DONE : failure_print(&failure);
    }
    free(track);
    return status;
}

const command_t command_report = {
    .name = "report",
    .order = 120,
    .arguments = "MODEL RECORDING NAME=BEFORE.csv,AFTER.csv...",
    .summary = "Show tracks with and without compensation, as one HTML page",
    .details = "MODEL is the model in the amplifier, RECORDING what it was fitted to. Each BEFORE and AFTER is a "
               "recording of the\n"
               "same reference by `hyst track`: with linear drive, and compensated. With --diagnosis both are "
               "compensated: by the\n"
               "first model, and by MODEL, which the diagnosis derived from it.",
    .run = run,
    .files = FILE_MODEL FILE_RECORDING "FILE: one HTML page; it needs nothing beside it.\n"
                                       "FILE.svg: a picture.\n",
    .examples = "# The page that compares two tracks of one reference\n"
                "hyst track --port /dev/ttyUSB0 --waveform sine --both -o sine.csv\n"
                "hyst report model.json recording.csv sine=sine-linear.csv,sine-compensate.csv -o report.html\n"};
