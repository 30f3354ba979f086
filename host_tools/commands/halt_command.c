/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "commands/halt_command.h"
#include "amplifier/device/mode_names.h"
#include "amplifier/driving.h"
#include "base/json_output.h"
#include "command_line/device_options.h"
#include "command_line/print.h"
#include "loop/telemetry.h"
#include <stdio.h>

typedef struct {
    device_options_t line;
    const halt_command_t *halt;
    bool off;
    bool json;
} settings_t;

/* Only what holds waits for requests: in park there is no communication timeout. */
static bool holds(const int64_t now[REGISTER_COUNT]) {
    return now[INDEX_state] == LOOP_IDLE;
}

/* What became of the drive. */
static void print(const int64_t now[REGISTER_COUNT], const halt_command_t *halt, double parks_after_s) {
    const int64_t power = now[INDEX_amplifier_state];
    printf("%s; ", halt->sentence);
    if (power == AMPLIFIER_OFF) {
        printf("the amplifier is off");
    } else if (power == AMPLIFIER_STOP || power == AMPLIFIER_FAULT) {
        printf("the drive goes to rest, where the stage is off");
    } else if (!holds(now)) {
        printf("the drive goes to rest");
    } else {
        printf("the drive holds");
    }
    printf(", in mode %s", mode_name(now[INDEX_active_mode]));
    if (parks_after_s > 0.0) {
        printf("; it parks after %g s without a request", parks_after_s);
    }
    putchar('\n');
}

static control_command_t wanted(const settings_t *s) {
    return s->off ? COMMAND_DISARM : s->halt->halt;
}

/* Nothing else of such a map is known here: it gets the command, and is not looked at. */
static bool halt_unknown(device_t *device, const settings_t *s, failure_t *failure) {
    int64_t nothing[REGISTER_COUNT];
    if (!driving_halt(device, wanted(s), nothing, failure)) {
        return false;
    }
    if (s->json) {
        const bool good =
            json_print(json_pack("{s:s, s:n, s:n, s:n}", "format", s->halt->format, "mode", "state", "amplifier_state"),
                       JSON_INDENT(2), failure);
        if (!good || !text_wanted(true)) {
            return good;
        }
    }
    printf("the amplifier has taken the command; what it does now is not read: its register map version %d is unknown "
           "here\n",
           (int)device_identity(device, INDEX_abi));
    return true;
}

static bool halt(device_t *device, const settings_t *s, failure_t *failure) {
    int64_t now[REGISTER_COUNT], watchdog_ms = 0;
    const halt_command_t *const command = s->halt;
    if (!device_map_known(device)) {
        return halt_unknown(device, s, failure);
    }
    device_print_left_fault(device);
    if (!driving_halt(device, wanted(s), now, failure) ||
        (holds(now) && !device_read(device, INDEX_watchdog, &watchdog_ms, failure))) {
        return false;
    }
    const double parks_after_s = (double)watchdog_ms / 1000.0;
    if (s->json) {
        json_t *object =
            json_pack("{s:s, s:s, s:s, s:s}", "format", command->format, "mode", mode_name(now[INDEX_active_mode]),
                      "state", state_name(now[INDEX_state]), "amplifier_state", power_name(now[INDEX_amplifier_state]));
        if (parks_after_s > 0.0) {
            json_object_set_new(object, "parks_after_s", json_real(parks_after_s));
        }
        const bool good = json_print(object, JSON_INDENT(2), failure);
        if (!good || !text_wanted(true)) {
            return good;
        }
    }
    print(now, command, parks_after_s);
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
        {"--off", NULL, OPTION_FLAG, NULL, "and then switch the stage off; waits until it is", &s.off},
    };
    const size_t count = sizeof options / sizeof options[0] - (halt_command->halt == COMMAND_PARK ? 0 : 1);
    const device_work_t job = {.settings = &s, .line = &s.line, .any_map = true, .work = work};
    return device_command_run(command, options, count, argc, argv, &job);
}
