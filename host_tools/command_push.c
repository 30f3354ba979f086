/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "amplifier_image.h"
#include "compile.h"
#include "hysteresis_text.h"
#include "json_output.h"
#include <inttypes.h>
#include <stdio.h>

static bool push(const char *path, const device_options_t *line, bool json, failure_t *failure) {
    hyst_parameters_t parameters;
    if (!image_read(&parameters, path, failure)) {
        return false;
    }
    device_t *device = device_open(line, failure);
    if (device == NULL) {
        return false;
    }
    const bool done = amplifier_image_write(device, &parameters, failure);
    device_close(device);
    if (!done) {
        return false;
    }
    if (json) {
        return json_print(json_pack("{s:s, s:s, s:I, s:s, s:I, s:b}", "format", "hyst-push-1", "image", path,
                                    "model_id", (json_int_t)parameters.model_id, "hysteresis",
                                    hysteresis_name(&parameters), "operators", (json_int_t)hysteresis_size(&parameters),
                                    "verified", true),
                          JSON_INDENT(2), failure);
    }
    char hysteresis[120];
    hysteresis_text(&parameters, hysteresis);
    printf("%s is in force and read back the same: model 0x%08" PRIX32 ", %s\n", path, parameters.model_id, hysteresis);
    return true;
}

static int run(int argc, char **argv) {
    device_options_t line = DEVICE_OPTIONS_DEFAULT;
    bool json = false;
    const option_t options[] = {
        DEVICE_OPTIONS(line),
        {"--json", NULL, OPTION_FLAG, NULL, "result as JSON on stdout", &json},
    };
    int status = device_options_parse(&command_push, options, sizeof options / sizeof options[0], argc, argv, 1, &line);
    if (status != OPTIONS_RUN) {
        return status;
    }
    failure_t failure;
    return push(argv[1], &line, json, &failure) ? STATUS_DONE : failure_print(&failure);
}

const command_t command_push = {
    "push", "IMAGE --port DEV", "Put a parameter image into the amplifier",
    "Checks the image as the amplifier would, uploads and commits it, and reads it back. The amplifier changes over\n"
    "between two samples and without a step of the drive. What it refuses changes nothing.",
    run};
