/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "command_line/recording_input.h"
#include "commands/command.h"
#include "look/look_json.h"
#include "look/look_text.h"
#include <stdlib.h>

static int run(int argc, char **argv);

const command_t command_look = {
    .name = "look",
    .order = 25,
    .arguments = "RECORDING... [--json[=F.json]]",
    .summary = "Show what recordings hold, and what is wrong with them, before any model",
    .details = "What the drive did, noise from rests and repetitions, frequency response, what rings after steps, "
               "creep in holds.\n"
               "Faults of the recording (lost or stuck samples, two clocks, outliers, a clipped converter ..) come "
               "with their\n"
               "samples and what to change. `hyst diagnose` begins with the same.",
    .files = FILE_RECORDING "F.json: the same for programs, format hyst-look-1.\n",
    .examples = "# What is in a recording, and what is wrong with it?\n"
                "hyst look recording.csv\n"
                "# Two days together, for a program\n"
                "hyst look monday.csv tuesday.csv --json=look.json\n",
    .run = run};

static int run(int argc, char **argv) {
    bool json = false;
    span_t span = SPAN_WHOLE;
    const option_t options[] = {SPAN_OPTIONS(span), JSON_OPTION_KIND(OPTION_JSON_OR_WORD, &json)};
    size_t count;
    failure_t failure;
    look_t *looks = NULL;
    const int status =
        options_parse(&command_look, options, sizeof options / sizeof options[0], argc, argv, 1, (size_t)argc, &count);
    if (status != OPTIONS_RUN) {
        return status;
    }
    recording_t *recordings = read_spans_aloud(argv + 1, count, &span, &failure);
    bool good = recordings != NULL;
    looks = good ? looks_at(recordings, count, &failure) : NULL;
    good = looks != NULL;
    if (good) {
        fault_list_t faults;
        faults_find(looks, count, &faults);
        if (json) {
            json_t *all = looks_to_json(looks, count, &faults);
            json_object_set_new(all, "format", json_string("hyst-look-1"));
            good = json_print(all, JSON_INDENT(1) | JSON_REAL_PRECISION(17), &failure);
        }
        if (good && text_wanted(json)) {
            looks_print(stdout, looks, count, &faults);
        }
        faults_free(&faults);
        looks_free(looks, count);
    }
    recordings_free(recordings, count);
    return good ? STATUS_DONE : failure_print(&failure);
}
