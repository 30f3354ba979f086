/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "amplifier/amplifier_image.h"
#include "amplifier/device/opening.h"
#include "base/json_output.h"
#include "base/shown_name.h"
#include "command_line/device_options.h"
#include "commands/command.h"
#include "compile/compile.h"
#include "compile/hysteresis_text.h"
#include <inttypes.h>
#include <stdio.h>

static bool pull(const char *path, const device_options_t *line, bool json, failure_t *failure) {
    device_t *device = device_open(line, failure);
    if (device == NULL) {
        return false;
    }
    hyst_parameters_t parameters;
    const bool read = amplifier_image_read(device, &parameters, failure);
    device_close(device);
    if (!read || !image_write(&parameters, path, failure)) {
        return false;
    }
    if (json) {
        const bool good =
            json_print(json_pack("{s:s, s:s, s:I, s:s, s:I}", "format", "hyst-pull-1", "image", shown_name(path),
                                 "model_id", (json_int_t)parameters.model_id, "hysteresis",
                                 hysteresis_name(&parameters), "operators", (json_int_t)hysteresis_size(&parameters)),
                       JSON_INDENT(2), failure);
        if (!good || !text_wanted(true)) {
            return good;
        }
    }
    char hysteresis[120];
    hysteresis_text(&parameters, hysteresis);
    printf("%s: the image in force, model 0x%08" PRIX32 ", %s\n", shown_name(path), parameters.model_id, hysteresis);
    return true;
}

static int run(int argc, char **argv) {
    device_options_t line = DEVICE_OPTIONS_DEFAULT;
    const char *output = NULL;
    bool json = false;
    const option_t options[] = {
        DEVICE_OPTIONS(line),
        {"--output", "-o", OPTION_OUTPUT, "IMAGE", "file to write", &output},
        JSON_OPTION(&json),
    };
    int status = device_options_parse(&command_pull, options, sizeof options / sizeof options[0], argc, argv, 0, &line);
    if (status == OPTIONS_RUN && output == NULL) {
        status = usage_error(&command_pull, "-o IMAGE is missing");
    }
    if (status != OPTIONS_RUN) {
        return status;
    }
    failure_t failure;
    return pull(output, &line, json, &failure) ? STATUS_DONE : failure_print(&failure);
}

const command_t command_pull = {.name = "pull",
                                .order = 70,
                                .arguments = "--port DEV -o IMAGE",
                                .summary = "Copy the parameter image in force into a file",
                                .details = "The file is what `hyst push` takes; see `hyst info` for what it says.",
                                .run = run,
                                .files = FILE_IMAGE,
                                .examples = "# Keep what is in force before a new image goes in\n"
                                            "hyst pull --port /dev/ttyUSB0 -o before.image\n"
                                            "hyst push model.image --port /dev/ttyUSB0\n"};
