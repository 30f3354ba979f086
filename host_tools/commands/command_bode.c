/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "base/json_output.h"
#include "command_line/recording_input.h"
#include "commands/command.h"
#include "report/bode.h"
#include "report/small_signal.h"
#include <stdio.h>
#include <string.h>

static int bode(int argc, char **argv);

const command_t command_bode = {
    .name = "bode",
    .order = 27,
    .arguments = "[RECORDING] [--model MODEL.json] [options]",
    .summary = "Show the frequency response of a recording, and of a model",
    .details =
        "Gain, phase and coherence from drive to position: by whole periods where the drive repeats itself, else by\n"
        "local polynomials. With --model also of the model under the same drive, estimated in the same way. Without a\n"
        "recording that of the model alone, for small signals around a bias: a sum of sines whose peak is the "
        "amplitude.",
    .run = bode,
    .files = FILE_RECORDING FILE_MODEL "F.json: the same for programs, format hyst-bode-1.\n"
                                       "PAGE.html: one page with pictures; it needs nothing beside it.\n",
    .examples = "# Gain and phase over frequency, and where the drive explains the position\n"
                "hyst bode recording.csv\n"
                "# Does the model ring where the actuator does? As a page\n"
                "hyst bode recording.csv --model model.json -o bode.html\n"
                "# The model alone, for small signals around 50 V\n"
                "hyst bode --model model.json --bias 50 --amplitude 1\n"};

typedef struct {
    const char *model, *page;
    bool json;
    small_signal_t small;
} wishes_t;

static bool show(const wishes_t *wishes, const bode_t *response, bool small, failure_t *failure) {
    if (wishes->json) {
        json_t *all = bode_to_json(response);
        json_object_set_new(all, "format", json_string("hyst-bode-1"));
        if (!json_print(all, JSON_INDENT(1), failure)) {
            return false;
        }
    }
    if (wishes->page != NULL && !bode_write_page(response, small, wishes->page, failure)) {
        return false;
    }
    if (text_wanted(wishes->json)) {
        bode_print(stdout, response);
    }
    return true;
}

/* The recording's response, and that of the model if there is one. */
static bool run(const wishes_t *wishes, const recording_t *recording, const model_t *model, bool small,
                failure_t *failure) {
    bode_t response;
    if (!bode_ask(recording, model, &response, failure)) {
        return false;
    }
    const bool good = show(wishes, &response, small, failure);
    bode_free(&response);
    return good;
}

static int bode(int argc, char **argv) {
    wishes_t wishes = {.small = small_signal_unset()};
    const option_t options[] = {
        {"--model", NULL, OPTION_INPUT, "MODEL.json", "show the response of this model, too", (void *)&wishes.model},
        JSON_OPTION(&wishes.json),
        {"--output", "-o", OPTION_OUTPUT, "PAGE.html", "write it as a page with pictures", (void *)&wishes.page},
        {"--bias", NULL, OPTION_NUMBER, "V", "without a recording: drive around this (middle of the model's range)",
         &wishes.small.bias_v},
        {"--amplitude", NULL, OPTION_NUMBER, "V",
         "without a recording: peak of the drive about the bias (a hundredth of the model's range)",
         &wishes.small.amplitude_v},
        {"--sample-rate", NULL, OPTION_NUMBER, "HZ", "without a recording: instead of the model's",
         &wishes.small.sample_rate_hz}};
    size_t count;
    failure_t failure;
    model_t model = {0};
    recording_t recording = {0};
    const int status =
        options_parse(&command_bode, options, sizeof options / sizeof options[0], argc, argv, 0, 1, &count);
    if (status != OPTIONS_RUN) {
        return status;
    }
    if (count == 0 && wishes.model == NULL) {
        return usage_error(&command_bode, "expected a recording, or --model, or both");
    }
    if (count == 1 && small_signal_set(&wishes.small)) {
        return usage_error(&command_bode, "--bias, --amplitude and --sample-rate are for a model without a recording");
    }
    bool good = wishes.model == NULL || model_read(&model, wishes.model, &failure);
    if (good) {
        good = count == 1 ? read_recording_aloud(&recording, argv[1], &failure)
                          : small_signal(&model, wishes.model, &wishes.small, &recording, &failure);
        good =
            good && run(&wishes, &recording, count == 1 && wishes.model != NULL ? &model : NULL, count == 0, &failure);
        recording_free(&recording);
        if (wishes.model != NULL) {
            model_free(&model);
        }
    }
    return good ? STATUS_DONE : failure_print(&failure);
}
