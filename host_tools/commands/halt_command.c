/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "commands/halt_command.h"
#include "amplifier/driving.h"
#include "amplifier/mode_names.h"
#include "base/json_output.h"
#include "command_line/device_options.h"
#include "command_line/print.h"
#include <stdio.h>

typedef struct {
    device_options_t line;
    const halt_command_t *halt;
    bool json;
} settings_t;

static bool halt(device_t *device, const settings_t *s, failure_t *failure) {
    int64_t now[REGISTER_COUNT];
    if (!driving_halt(device, s->halt->halt, now, failure)) {
        return false;
    }
    const char *mode = mode_name(now[INDEX_active_mode]);
    if (s->json) {
        const bool good = json_print(json_pack("{s:s, s:s, s:s}", "format", s->halt->format, "mode", mode, "state",
                                               state_name(now[INDEX_state])),
                                     JSON_INDENT(2), failure);
        if (!good || !text_wanted(true)) {
            return good;
        }
    }
    printf("%s, in mode %s\n", s->halt->sentence, mode);
    return true;
}

static int work(device_t *device, void *settings) {
    failure_t failure;
    return halt(device, settings, &failure) ? STATUS_DONE : failure_print(&failure);
}

int halt_command_run(const command_t *command, const halt_command_t *halt_command, int argc, char **argv) {
    settings_t s = {.line = DEVICE_OPTIONS_DEFAULT, .halt = halt_command};
    const option_t options[] = {
        DEVICE_OPTIONS(s.line),
        JSON_OPTION(&s.json),
    };
    const device_work_t job = {.settings = &s, .line = &s.line, .work = work};
    return device_command_run(command, options, sizeof options / sizeof options[0], argc, argv, &job);
}
