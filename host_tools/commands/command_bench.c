/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "base/json_output.h"
#include "base/stop_signal.h"
#include "bench/emulator.h"
#include "bench/firmware_file.h"
#include "bench/twin_file.h"
#include "command_line/twin_options.h"
#include "commands/command.h"
#include <errno.h>
#include <pthread.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

typedef struct {
    const emulator_t *emulator;
    bool json;
} announcement_t;

/* The loop has made its first sample: the amplifier runs. */
static void announce(void *context) {
    const announcement_t *announcement = context;
    failure_t failure;
    if (announcement->json &&
        !json_print(json_pack("{s:s, s:s}", "format", "hyst-bench-1", "port", announcement->emulator->port), 0,
                    &failure)) {
        failure_print(&failure);
    }
    if (text_wanted(announcement->json)) {
        printf("port: %s\n", announcement->emulator->port);
    }
    (void)fflush(stdout);
}

/* A separate thread: what stands at the other end of stdin has ended, however that came. */
static void *end_with_input(void *nothing) {
    char ignored[256];
    ssize_t count;
    sigset_t ending; /* the other thread's to take: it is what the signal interrupts */
    sigemptyset(&ending);
    sigaddset(&ending, SIGTERM);
    (void)pthread_sigmask(SIG_BLOCK, &ending, NULL);
    do {
        count = read(STDIN_FILENO, ignored, sizeof ignored);
    } while (count > 0 || (count < 0 && errno == EINTR));
    (void)kill(getpid(), SIGTERM);
    return nothing;
}

static bool attach(failure_t *failure) {
    pthread_t thread;
    const int error = pthread_create(&thread, NULL, end_with_input, NULL);
    if (error != 0) {
        return fail(failure, "cannot start a thread: %s", strerror(error));
    }
    (void)pthread_detach(thread);
    return true;
}

static bool bench(const char *program, const char *image, const char *model, const twin_settings_t *settings,
                  bool attached, bool json, failure_t *failure) {
    const volatile sig_atomic_t *stop = stop_on_signal();
    if (attached && !attach(failure)) {
        return false;
    }
    twin_t *twin = twin_from_file(model, &settings->twin, failure);
    if (twin == NULL) {
        return false;
    }
    emulator_t emulator;
    if (!emulator_start(&emulator, program, image, failure)) {
        twin_close(twin);
        return false;
    }
    emulator.line.stop = stop;
    announcement_t announcement = {&emulator, json};
    twin_run_t run;
    bool ok = twin_run(twin, &emulator.line, announce, &announcement, &run, failure);
    twin_close(twin);
    failure_t ignored;
    ok = ok && (*stop != 0 || emulator_has_ended(&emulator, failure));
    (void)emulator_stop(&emulator, &ignored);
    if (ok || run.samples > 0) {
        twin_print_run(&run, settings);
    }
    return ok;
}

static int run(int argc, char **argv) {
    twin_settings_t settings = TWIN_SETTINGS_DEFAULT;
    const char *program = "qemu-system-arm";
    const char *image = NULL;
    const char *model = NULL;
    bool json = false, attached = false;
    const option_t options[] = {
        {"--image", NULL, OPTION_INPUT, "ELF", "firmware of the board `bench` (that of this program)", &image},
        {"--model", NULL, OPTION_INPUT, "MODEL", "the actuator", &model},
        TWIN_OPTIONS(settings),
        {"--qemu", NULL, OPTION_TEXT, "PROGRAM", "emulator (qemu-system-arm)", &program},
        {"--attached", NULL, OPTION_FLAG, NULL, "end when standard input does, as a pipe of a program that has ended",
         &attached},
        JSON_OPTION(&json),
    };
    size_t arguments = 0;
    int status =
        options_parse(&command_bench, options, sizeof options / sizeof options[0], argc, argv, 0, 0, &arguments);
    if (status == OPTIONS_RUN && model == NULL) {
        status = usage_error(&command_bench, "--model MODEL is needed");
    }
    if (status == OPTIONS_RUN) {
        status = twin_options_check(&command_bench, &settings);
    }
    if (status == OPTIONS_RUN) {
        status = twin_rate_check(&command_bench, &settings, image);
    }
    if (status != OPTIONS_RUN) {
        return status;
    }
    failure_t failure;
    char own_image[4096];
    if (image == NULL) {
        if (!firmware_file_find(own_image, sizeof own_image, &failure)) {
            return failure_print(&failure);
        }
        image = own_image;
    }
    return bench(program, image, model, &settings, attached, json, &failure) ? STATUS_DONE : failure_print(&failure);
}

const command_t command_bench = {
    .name = "bench",
    .order = 140,
    .arguments = "--model MODEL",
    .summary = "Run the amplifier's firmware under emulation, with its twin",
    .details =
        "Starts qemu-system-arm and the twin. As soon as the loop runs, the first line on stdout says where the "
        "amplifier's\n"
        "Modbus line is, as `port: /dev/pts/N`, which is what the other commands take as --port. Runs until Ctrl-C.",
    .run = run,
    .files = FILE_MODEL "ELF: the firmware of the board `bench`. One comes with the program.\n",
    .examples = "# An amplifier without hardware: the first line says which port it is\n"
                "hyst bench --model twin.json --noise-um 0.02\n"
                "# Then, in another terminal, with that port\n"
                "hyst info --port /dev/pts/3\n"};
