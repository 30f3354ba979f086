/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "amplifier/backup.h"
#include "base/json_output.h"
#include "base/shown_name.h"
#include "command_line/device_options.h"
#include "commands/command.h"
#include <stdio.h>

typedef struct {
    device_options_t line;
    const char *output;
    bool json;
} settings_t;

static bool back_up(device_t *device, const settings_t *s, failure_t *failure) {
    json_t *backup = backup_read(device, failure);
    if (backup == NULL) {
        return false;
    }
    const size_t settings = json_object_size(json_object_get(backup, "settings"));
    const size_t words = json_array_size(json_object_get(backup, "image"));
    if (!json_write(backup, s->output, failure)) {
        return false;
    }
    if (s->json &&
        !json_print(json_pack("{s:s, s:s, s:I, s:I}", "format", "hyst-backed-up-1", "backup", shown_name(s->output),
                              "settings", (json_int_t)settings, "image_words", (json_int_t)words),
                    JSON_INDENT(2), failure)) {
        return false;
    }
    if (!text_wanted(s->json)) {
        return true;
    }
    printf("%s: %zu settings, and ", shown_name(s->output), settings);
    if (words > 0) {
        printf("the image in force of %zu words\n", words);
    } else {
        printf("no image, as there is none in force\n");
    }
    return true;
}

static int work(device_t *device, void *settings) {
    failure_t failure;
    return back_up(device, settings, &failure) ? STATUS_DONE : failure_print(&failure);
}

static int check(void *settings) {
    const settings_t *s = settings;
    return s->output != NULL ? OPTIONS_RUN : usage_error(&command_backup, "-o BACKUP.json is missing");
}

static int run(int argc, char **argv) {
    settings_t s = {.line = DEVICE_OPTIONS_DEFAULT};
    const option_t options[] = {
        DEVICE_OPTIONS(s.line),
        {"--output", "-o", OPTION_OUTPUT, "BACKUP.json", "file to write", &s.output},
        JSON_OPTION(&s.json),
    };
    const device_work_t job = {.settings = &s, .line = &s.line, .check = check, .work = work};
    return device_command_run(&command_backup, options, sizeof options / sizeof options[0], argc, argv, &job);
}

const command_t command_backup = {
    .name = "backup",
    .order = 72,
    .arguments = "--port DEV -o BACKUP.json",
    .summary = "Keep everything that is set in the amplifier",
    .details = "The parameter image in force and all registers that hold settings. `hyst restore` puts them back, into "
               "this\n"
               "amplifier or another one. What moves (mode, setpoint) is not in it, nor what an amplifier never keeps: "
               "locks, and\n"
               "the communication timeout.",
    .run = run,
    .files = "BACKUP.json: image and settings, format hyst-backup-1.\n",
    .examples = "# Before anything is changed\n"
                "hyst backup --port /dev/ttyUSB0 -o before.json\n"};
