/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "command.h"
#include "report.h"
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
    if (!json) {
        report_print(report);
        return true;
    }
    json_t *result = report_to_json(report);
    const bool written = json_dumpf(result, stdout, JSON_INDENT(2)) == 0 && putchar('\n') != EOF;
    json_decref(result);
    return written || fail(failure, "cannot write to stdout");
}

static int run(int argc, char **argv) {
    const char *output = "report.html", *picture = NULL, *simulated = NULL, *diagnosis = NULL;
    bool json = false;
    const option_t options[] = {
        {"--output", "-o", OPTION_TEXT, "FILE", "page to write (report.html)", (void *)&output},
        {"--picture", NULL, OPTION_TEXT, "FILE.svg", "error traces as a picture of their own", (void *)&picture},
        {"--simulated", NULL, OPTION_TEXT, "TEXT", "say that the tracks were simulated, and how", (void *)&simulated},
        {"--diagnosis", NULL, OPTION_TEXT, "F.json",
         "BEFORE and AFTER are compensated both, and this diagnosis lies between them", (void *)&diagnosis},
        {"--json", NULL, OPTION_FLAG, NULL, "numbers as JSON on stdout", &json},
    };
    size_t arguments = 0;
    const int parsed = options_parse(&command_report, options, sizeof options / sizeof options[0], argc, argv, 3,
                                     (size_t)argc, &arguments);
    if (parsed != OPTIONS_RUN) {
        return parsed;
    }

    failure_t failure;
    model_t model;
    if (!model_read(&model, argv[1], &failure)) {
        return failure_print(&failure);
    }
    recording_t recording;
    if (!recording_read(&recording, argv[2], &failure)) {
        model_free(&model);
        return failure_print(&failure);
    }
    report_t report = {.model = &model,
                       .recording = &recording,
                       .simulated = simulated,
                       .track = allocate(arguments - 2, sizeof *report.track)};
    int status = STATUS_DONE;
    if (diagnosis != NULL) {
        report.diagnosis = report_diagnosis_read(diagnosis, &failure);
        status = report.diagnosis != NULL ? STATUS_DONE : failure_print(&failure);
    }
    for (size_t i = 3; i <= arguments && status == STATUS_DONE; i++) {
        const char *name = argv[i], *before = NULL, *after = NULL;
        if (!split_track(argv[i], &before, &after)) {
            status = usage_error(&command_report, "'%s' is not NAME=BEFORE.csv,AFTER.csv", argv[i]);
        } else if (!report_track_read(&report.track[report.tracks], name, before, after, &failure)) {
            status = failure_print(&failure);
        } else {
            report.tracks++;
        }
    }
    if (status == STATUS_DONE && picture != NULL && !report_write_picture(&report, picture, &failure)) {
        status = failure_print(&failure);
    }
    if (status == STATUS_DONE && !write_report(&report, output, json, &failure)) {
        status = failure_print(&failure);
    }
    for (size_t i = 0; i < report.tracks; i++) {
        report_track_free(&report.track[i]);
    }
    free(report.track);
    json_decref(report.diagnosis);
    recording_free(&recording);
    model_free(&model);
    return status;
}

const command_t command_report = {
    "report", "MODEL RECORDING NAME=BEFORE.csv,AFTER.csv...",
    "Show tracks with and without compensation, as one HTML page",
    "MODEL is what the amplifier was given, RECORDING what it was fitted to. Each BEFORE and AFTER is a recording of\n"
    "the same reference by `hyst track`, with linear drive and compensated; or, with --diagnosis, compensated by the\n"
    "first model and by MODEL, which the diagnosis made of it.",
    run};
