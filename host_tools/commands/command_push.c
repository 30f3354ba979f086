/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "amplifier/amplifier_image.h"
#include "amplifier/device/opening.h"
#include "amplifier/image_difference.h"
#include "base/json_output.h"
#include "base/shown_name.h"
#include "command_line/device_options.h"
#include "commands/command.h"
#include "compile/compile.h"
#include "compile/hysteresis_text.h"
#include <inttypes.h>
#include <stdio.h>

static json_t *difference_to_json(const image_difference_t *d) {
    return json_pack("{s:s, s:s, s:f, s:f, s:I, s:I}", "field", d->field, "unit", d->unit, "device", d->before, "file",
                     d->after, "differing", (json_int_t)d->differing, "of", (json_int_t)d->count);
}

static void print_difference(const image_difference_t *d) {
    printf("  %-22s %14.6g -> %-14.6g %s", d->field, d->before, d->after, d->unit);
    if (d->count > 0) {
        printf("%s(the most of %zu that differ, of %zu)", d->unit[0] != '\0' ? " " : "", d->differing, d->count);
    }
    putchar('\n');
}

/* What a push would change; it changes nothing. */
static bool dry_run(const char *path, const device_options_t *line, bool json, failure_t *failure) {
    hyst_parameters_t file, held;
    image_difference_t difference[IMAGE_DIFFERENCES_MOST];
    if (!image_read(&file, path, failure)) {
        return false;
    }
    device_t *device = device_open(line, failure);
    const bool read = device != NULL && amplifier_image_read(device, &held, failure);
    device_close(device);
    if (!read) {
        return false;
    }
    const size_t count = image_differences(&held, &file, difference);
    if (json) {
        json_t *list = json_array();
        for (size_t i = 0; i < count; i++) {
            json_array_append_new(list, difference_to_json(&difference[i]));
        }
        return json_print(json_pack("{s:s, s:s, s:b, s:o}", "format", "hyst-push-1", "image", path, "dry_run", true,
                                    "differences", list),
                          JSON_INDENT(2), failure);
    }
    printf(count > 0 ? "%s would change, from the amplifier's image to the file's:\n"
                     : "%s is what is in force already; nothing would change\n",
           path);
    for (size_t i = 0; i < count; i++) {
        print_difference(&difference[i]);
    }
    return true;
}

static bool push(const char *path, const device_options_t *line, bool store, bool json, failure_t *failure) {
    hyst_parameters_t parameters;
    if (!image_read(&parameters, path, failure)) {
        return false;
    }
    device_t *device = device_open(line, failure);
    if (device == NULL) {
        return false;
    }
    device_print_driven(device);
    const bool done =
        amplifier_image_write(device, &parameters, failure) && (!store || amplifier_image_store(device, failure));
    device_close(device);
    if (!done) {
        return false;
    }
    if (json) {
        const bool good = json_print(
            json_pack("{s:s, s:s, s:I, s:s, s:I, s:b, s:b}", "format", "hyst-push-1", "image", shown_name(path),
                      "model_id", (json_int_t)parameters.model_id, "hysteresis", hysteresis_name(&parameters),
                      "operators", (json_int_t)hysteresis_size(&parameters), "verified", true, "stored", store),
            JSON_INDENT(2), failure);
        if (!good || !text_wanted(true)) {
            return good;
        }
    }
    char hysteresis[120];
    hysteresis_text(&parameters, hysteresis);
    printf("%s is in force and read back the same: model 0x%08" PRIX32 ", %s%s\n", shown_name(path),
           parameters.model_id, hysteresis, store ? "; stored for the next start, with the limits that are set" : "");
    return true;
}

static int run(int argc, char **argv) {
    device_options_t line = DEVICE_OPTIONS_DEFAULT;
    bool json = false;
    bool dry = false;
    bool store = false;
    const option_t options[] = {
        DEVICE_OPTIONS(line),
        {"--dry-run", NULL, OPTION_FLAG, NULL, "only say what would change, in units", &dry},
        {"--store", NULL, OPTION_FLAG, NULL, "and store it with the limits that are set; the amplifier has to be off",
         &store},
        JSON_OPTION(&json),
    };
    int status = device_options_parse(&command_push, options, sizeof options / sizeof options[0], argc, argv, 1, &line);
    if (status != OPTIONS_RUN) {
        return status;
    }
    if (dry && store) {
        return usage_error(&command_push, "--dry-run and --store exclude each other");
    }
    failure_t failure = {0};
    const bool good = dry ? dry_run(argv[1], &line, json, &failure) : push(argv[1], &line, store, json, &failure);
    return good ? STATUS_DONE : failure_print(&failure);
}

const command_t command_push = {
    .name = "push",
    .order = 60,
    .arguments = "IMAGE --port DEV",
    .summary = "Put a parameter image into the amplifier",
    .details = "Checks the image as the amplifier would, uploads and commits it, and reads it back. The amplifier "
               "changes over\n"
               "between two samples and without a step of the drive, also while another master drives, which is noted "
               "and keeps its\n"
               "keys. What it refuses changes nothing.\n"
               "With --store the next start has this image, and the limits that are set now: output range, limits of "
               "the reference,\n"
               "current, temperature and supplies. Without it a start has what was stored before, or nothing.",
    .run = run,
    .files = FILE_IMAGE,
    .examples = "# What would change?\n"
                "hyst push model.image --port /dev/ttyUSB0 --dry-run\n"
                "# Put an image into the amplifier and read it back\n"
                "hyst push model.image --port /dev/ttyUSB0\n"
                "# And keep it over a reset\n"
                "hyst push model.image --port /dev/ttyUSB0 --store\n"
                "# A slower line, and another address\n"
                "hyst push model.image --port /dev/ttyUSB0 --baud 57600 --slave 3\n"};
