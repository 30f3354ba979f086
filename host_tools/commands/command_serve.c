/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "base/json_output.h"
#include "base/stop_signal.h"
#include "bench/emulator.h"
#include "bench/firmware_file.h"
#include "bench/twin_file.h"
#include "command_line/device_options.h"
#include "command_line/twin_options.h"
#include "commands/command.h"
#include "serve/session.h"
#include <pthread.h>
#include <stdio.h>
#include <string.h>

typedef struct {
    device_options_t line;
    twin_settings_t twin;
    const char *program, *image, *model; /* of the bench */
    const char *folder;
    bool bench, json;
    unsigned long listen;
} settings_t;

/* The emulated amplifier, and the thread in which its twin runs. */
typedef struct {
    emulator_t emulator;
    twin_t *twin;
    pthread_t thread;
    volatile sig_atomic_t stop; /* for the twin: after the amplifier was parked */
} bench_t;

static void *run_twin(void *context) {
    bench_t *const bench = context;
    twin_run_t run;
    failure_t failure;
    if (!twin_run(bench->twin, &bench->emulator.line, NULL, NULL, &run, &failure)) {
        (void)fprintf(stderr, "hyst serve: %s\n", failure.text); /* the page says that the line is cut */
    }
    return NULL;
}

static bool bench_open(bench_t *bench, const settings_t *s, failure_t *failure) {
    char own_image[4096];
    const char *const image = s->image != NULL ? s->image : own_image;
    if (s->image == NULL && !firmware_file_find(own_image, sizeof own_image, failure)) {
        return false;
    }
    *bench = (bench_t){.twin = twin_from_file(s->model, &s->twin.twin, failure)};
    if (bench->twin == NULL) {
        return false;
    }
    if (!emulator_start(&bench->emulator, s->program, image, failure)) {
        twin_close(bench->twin);
        return false;
    }
    bench->emulator.line.stop = &bench->stop;
    if (pthread_create(&bench->thread, NULL, run_twin, bench) != 0) {
        failure_t ignored;
        (void)emulator_stop(&bench->emulator, &ignored);
        twin_close(bench->twin);
        return fail(failure, "cannot start a thread");
    }
    return true;
}

static void bench_close(bench_t *bench) {
    failure_t ignored;
    bench->stop = SIGTERM;
    (void)pthread_join(bench->thread, NULL);
    (void)emulator_stop(&bench->emulator, &ignored);
    twin_close(bench->twin);
}

static bool tell_address(const settings_t *s, const char *address, failure_t *failure) {
    if (s->json &&
        !json_print(json_pack("{s:s, s:s}", "format", "hyst-serve-1", "page", address), JSON_COMPACT, failure)) {
        return false;
    }
    if (text_wanted(s->json)) {
        printf("page: %s\n", address);
    }
    return fflush(stdout) == 0 || fail(failure, "the page's address cannot be printed");
}

/* What the page says of the line, for who has no page open yet. */
static void tell_line(void *context, const char *why) {
    bool *cut = context;
    if (why != NULL) {
        (void)fprintf(stderr, "hyst serve: the line to the amplifier is cut; trying again .. (%s)\n", why);
    } else if (*cut) {
        (void)fputs("hyst serve: the line to the amplifier is there\n", stderr);
    }
    *cut = why != NULL;
}

static bool serve(settings_t *s, failure_t *failure) {
    const volatile sig_atomic_t *const stop = stop_on_signal();
    bench_t bench;
    bool cut = false; /* of tell_line */
    if (s->bench && !bench_open(&bench, s, failure)) {
        return false;
    }
    s->line.look_elsewhere = false; /* asked again and again while the line is cut */
    session_options_t options = {.line = s->line,
                                 .folder = s->folder,
                                 .port = (int)s->listen,
                                 .simulated = s->bench,
                                 .line_changed = tell_line,
                                 .context = &cut};
    if (s->bench) {
        options.line.port = bench.emulator.port;
        memcpy(options.drive_range_v, s->twin.twin.drive_range_v, sizeof options.drive_range_v);
        memcpy(options.position_range_um, s->twin.twin.position_range_um, sizeof options.position_range_um);
    }
    session_t *session = session_open(&options, failure);
    bool ok = session != NULL;
    if (ok) {
        ok = tell_address(s, session_address(session), failure) && session_run(session, stop, failure);
    }
    session_close(session);
    if (s->bench) {
        bench_close(&bench);
    }
    return ok;
}

static int check(settings_t *s) {
    if ((s->line.port != NULL) == s->bench) {
        return usage_error(&command_serve, "either --port DEV or --bench");
    }
    if (s->bench && s->model == NULL) {
        return usage_error(&command_serve, "--bench needs --model MODEL");
    }
    if (s->listen > 65535) {
        return usage_error(&command_serve, "--listen %lu: outside 0..65535", s->listen);
    }
    const int status = s->bench ? twin_options_check(&command_serve, &s->twin) : OPTIONS_RUN;
    return s->bench && status == OPTIONS_RUN ? twin_rate_check(&command_serve, &s->twin, s->image) : status;
}

static int run(int argc, char **argv) {
    settings_t s = {
        .line = DEVICE_OPTIONS_DEFAULT, .twin = TWIN_SETTINGS_DEFAULT, .program = "qemu-system-arm", .folder = "."};
    s.line.port_optional = true; /* --bench has one */
    const option_t options[] = {
        DEVICE_OPTIONS(s.line),
        {"--bench", NULL, OPTION_FLAG, NULL, "an emulated amplifier in place of a port", &s.bench},
        {"--listen", NULL, OPTION_COUNT, "N", "TCP port on 127.0.0.1 (one that is free)", &s.listen},
        {"--folder", NULL, OPTION_TEXT, "DIR", "where recordings, models and reports are (.)", &s.folder},
        JSON_OPTION(&s.json),
        {"--image", NULL, OPTION_INPUT, "ELF", "with --bench: firmware of the board `bench` (that of this program)",
         &s.image},
        {"--model", NULL, OPTION_INPUT, "MODEL", "with --bench: the actuator", &s.model},
        {"--qemu", NULL, OPTION_TEXT, "PROGRAM", "emulator (qemu-system-arm)", &s.program},
        TWIN_OPTIONS(s.twin),
    };
    int status =
        device_options_parse(&command_serve, options, sizeof options / sizeof options[0], argc, argv, 0, &s.line);
    if (status == OPTIONS_RUN) {
        status = check(&s);
    }
    if (status != OPTIONS_RUN) {
        return status;
    }
    failure_t failure;
    return serve(&s, &failure) ? STATUS_DONE : failure_print(&failure);
}

const command_t command_serve = {
    .name = "serve",
    .order = 95,
    .arguments = "--port DEV|--bench",
    .summary = "Show the amplifier on a live page in the browser, and work with it there",
    .details =
        "Prints the address of the page, and serves it to this machine only until Ctrl-C. The page shows reference, "
        "drive,\n"
        "position and error as they change, records, fits, diagnoses, compiles, pushes and tracks, and stops the "
        "amplifier at\n"
        "any time. The address holds a random token: who has it has the amplifier. The first page has control, others "
        "watch.",
    .run = run,
    .files = FILE_RECORDING FILE_MODEL FILE_IMAGE "DIR: these, and reports as HTML; the page sees no other files.\n",
    .examples = "# An amplifier at a port; open the address that is printed\n"
                "hyst serve --port /dev/ttyUSB0 --folder measurements\n"
                "# Without hardware\n"
                "hyst serve --bench --model twin.json --noise-um 0.02\n"};
