/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "amplifier/amplifier_image.h"
#include "amplifier/backup.h"
#include "base/json_input.h"
#include "base/shown_name.h"
#include "command_line/device_options.h"
#include "commands/command.h"
#include <stdio.h>

typedef struct {
    device_options_t line;
    const char *input;
    json_t *backup;
    bool store;
    bool json;
} settings_t;

static bool restore(device_t *device, const settings_t *s, failure_t *failure) {
    backup_done_t done;
    if (!backup_write(device, s->backup, s->input, &done, failure) ||
        (s->store && !amplifier_image_store(device, failure))) {
        return false;
    }
    if (s->json &&
        !json_print(json_pack("{s:s, s:s, s:I, s:b, s:I, s:b}", "format", "hyst-restore-1", "backup",
                              shown_name(s->input), "settings", (json_int_t)done.settings, "image", (int)done.image,
                              "not_there", (json_int_t)done.not_there, "stored", (int)s->store),
                    JSON_INDENT(2), failure)) {
        return false;
    }
    if (!text_wanted(s->json)) {
        return true;
    }
    printf("%s: %zu settings%s, read back the same%s\n", shown_name(s->input), done.settings,
           done.image ? " and the image" : "", s->store ? "; stored for the next start" : "");
    if (done.watchdog) {
        printf("note: the communication timeout (watchdog) of it is left out: who drives sets it\n");
    }
    if (done.not_there > 0) {
        printf("note: %zu settings of it are not in this amplifier's firmware\n", done.not_there);
    }
    return true;
}

static int work(device_t *device, void *settings) {
    failure_t failure;
    return restore(device, settings, &failure) ? STATUS_DONE : failure_print(&failure);
}

static int check(void *settings) {
    const settings_t *s = settings;
    return s->input != NULL ? OPTIONS_RUN : usage_error(&command_restore, "--from BACKUP.json is missing");
}

static bool prepare(void *settings, failure_t *failure) {
    settings_t *s = settings;
    s->backup = json_read(s->input, "a backup", failure);
    return s->backup != NULL;
}

static int run(int argc, char **argv) {
    settings_t s = {.line = DEVICE_OPTIONS_DEFAULT};
    const option_t options[] = {
        DEVICE_OPTIONS(s.line),
        {"--from", NULL, OPTION_INPUT, "BACKUP.json", "what `hyst backup` wrote", &s.input},
        {"--store", NULL, OPTION_FLAG, NULL, "and store image and limits; the amplifier has to be off", &s.store},
        JSON_OPTION(&s.json),
    };
    const device_work_t job = {.settings = &s, .line = &s.line, .check = check, .prepare = prepare, .work = work};
    const int status =
        device_command_run(&command_restore, options, sizeof options / sizeof options[0], argc, argv, &job);
    json_decref(s.backup);
    return status;
}

const command_t command_restore = {
    .name = "restore",
    .order = 74,
    .arguments = "--port DEV --from BACKUP.json",
    .summary = "Put back what `hyst backup` kept",
    .details = "Commits the image as `hyst push` does, writes the settings, and reads all of it back. Nothing moves. "
               "Settings that\n"
               "this amplifier's firmware does not have are counted in a note, and so is the communication timeout of "
               "an older\n"
               "backup, which is left out.",
    .run = run,
    .files = "BACKUP.json: image and settings, format hyst-backup-1.\n",
    .examples = "# After an exchange of the board\n"
                "hyst restore --port /dev/ttyUSB0 --from before.json --store\n"};
