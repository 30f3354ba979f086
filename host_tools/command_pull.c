/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "amplifier_image.h"
#include "compile.h"
#include "hysteresis_text.h"
#include "json_output.h"
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
        return json_print(json_pack("{s:s, s:s, s:I, s:s, s:I}", "format", "hyst-pull-1", "image", path, "model_id",
                                    (json_int_t)parameters.model_id, "hysteresis", hysteresis_name(&parameters),
                                    "operators", (json_int_t)hysteresis_size(&parameters)),
                          JSON_INDENT(2), failure);
    }
    char hysteresis[120];
    hysteresis_text(&parameters, hysteresis);
    printf("%s: the image in force, model 0x%08" PRIX32 ", %s\n", path, parameters.model_id, hysteresis);
    return true;
}

static int run(int argc, char **argv) {
    device_options_t line = DEVICE_OPTIONS_DEFAULT;
    const char *output = NULL;
    bool json = false;
    const option_t options[] = {
        DEVICE_OPTIONS(line),
        {"--output", "-o", OPTION_TEXT, "IMAGE", "file to write", &output},
        {"--json", NULL, OPTION_FLAG, NULL, "result as JSON on stdout", &json},
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

const command_t command_pull = {"pull", "--port DEV -o IMAGE", "Copy the parameter image in force into a file",
                                "The file is what `hyst push` takes; see `hyst info` for what it says.", run};
