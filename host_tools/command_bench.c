/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "emulator.h"
#include "json_output.h"
#include "stop_signal.h"
#include "twin_options.h"
#include <stdio.h>

typedef struct {
    const emulator_t *emulator;
    bool json;
} announcement_t;

/* The loop has made its first sample: the amplifier runs. */
static void announce(void *context) {
    const announcement_t *announcement = context;
    if (announcement->json) {
        printf("{\"format\": \"hyst-bench-1\", \"port\": \"%s\"}\n", announcement->emulator->port);
    } else {
        printf("port: %s\n", announcement->emulator->port);
    }
    (void)fflush(stdout);
}

static bool bench(const char *program, const char *image, const char *model, const twin_settings_t *settings, bool json,
                  failure_t *failure) {
    const volatile sig_atomic_t *stop = stop_on_signal();
    twin_t *twin = twin_from_file(model, settings, failure);
    if (twin == NULL) {
        return false;
    }
    emulator_t emulator;
    if (!emulator_start(&emulator, program, image, failure)) {
        twin_close(twin);
        return false;
    }
    converter_line_t line = {.file = emulator.converter_line, .name = "bench", .stop = stop};
    announcement_t announcement = {&emulator, json};
    twin_run_t run;
    bool ok = twin_run(twin, &line, announce, &announcement, &run, failure);
    twin_close(twin);
    failure_t ending;
    if (!emulator_stop(&emulator, &ending) && ok && !*stop) {
        *failure = ending;
        ok = false;
    }
    twin_print_run(&run, settings);
    return ok;
}

static int run(int argc, char **argv) {
    twin_settings_t settings = TWIN_SETTINGS_DEFAULT;
    const char *program = "qemu-system-arm";
    const char *image = NULL;
    const char *model = NULL;
    bool json = false;
    const option_t options[] = {
        {"--image", NULL, OPTION_TEXT, "ELF", "firmware of the board `bench`", &image},
        {"--model", NULL, OPTION_TEXT, "MODEL", "the actuator", &model},
        TWIN_OPTIONS(settings),
        {"--qemu", NULL, OPTION_TEXT, "PROGRAM", "emulator (qemu-system-arm)", &program},
        {"--json", NULL, OPTION_FLAG, NULL, "first line as JSON", &json},
    };
    size_t arguments = 0;
    int status =
        options_parse(&command_bench, options, sizeof options / sizeof options[0], argc, argv, 0, 0, &arguments);
    if (status == OPTIONS_RUN && (image == NULL || model == NULL)) {
        status = usage_error(&command_bench, "--image ELF and --model MODEL are both needed");
    }
    if (status == OPTIONS_RUN) {
        status = twin_options_check(&command_bench, &settings);
    }
    if (status != OPTIONS_RUN) {
        return status;
    }
    failure_t failure;
    return bench(program, image, model, &settings, json, &failure) ? STATUS_DONE : failure_print(&failure);
}

const command_t command_bench = {
    "bench", "--image ELF --model MODEL", "Run the amplifier's firmware under emulation, with its twin",
    "Starts qemu-system-arm and the twin. As soon as the loop runs, the first line on stdout says where the "
    "amplifier's\n"
    "Modbus line is, as `port: /dev/pts/N`, which is what the other commands take as --port. Runs until Ctrl-C.",
    run};
