/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "base/json_output.h"
#include "base/stop_signal.h"
#include "bench/twin_file.h"
#include "command_line/twin_options.h"
#include "commands/command.h"
#include <stdio.h>

static bool report(const twin_run_t *run, failure_t *failure) {
    return json_print(json_pack("{s:s, s:I, s:f, s:f}", "format", "hyst-twin-1", "samples", (json_int_t)run->samples,
                                "seconds", run->seconds, "samples_per_second",
                                run->seconds > 0.0 ? (double)run->samples / run->seconds : 0.0),
                      JSON_INDENT(2), failure);
}

static bool serve(const char *model, const char *path, const twin_settings_t *settings, bool json, failure_t *failure) {
    const volatile sig_atomic_t *stop = stop_on_signal();
    twin_t *twin = twin_from_file(model, &settings->twin, failure);
    if (twin == NULL) {
        return false;
    }
    converter_line_t line;
    twin_run_t run = {0};
    const converter_status_t status = converter_open(&line, path, stop, failure);
    bool ok = status != CONVERTER_FAILED;
    if (status == CONVERTER_DONE) {
        ok = twin_run(twin, &line, NULL, NULL, &run, failure);
        converter_close(&line);
    }
    twin_close(twin);
    ok = ok && (!json || report(&run, failure));
    if (!text_wanted(json)) {
        return ok;
    }
    twin_print_run(&run, settings);
    return ok;
}

static int run(int argc, char **argv) {
    twin_settings_t settings = TWIN_SETTINGS_DEFAULT;
    const char *converter = NULL;
    bool json = false;
    const option_t options[] = {
        {"--converter", "-c", OPTION_TEXT, "PATH",
         "converter line: the named pipes PATH.asks and PATH.answers are made", &converter},
        TWIN_OPTIONS(settings),
        JSON_OPTION(&json),
    };
    size_t arguments = 0;
    int status =
        options_parse(&command_twin, options, sizeof options / sizeof options[0], argc, argv, 1, 1, &arguments);
    if (status == OPTIONS_RUN && converter == NULL) {
        status = usage_error(&command_twin, "--converter PATH is missing");
    }
    if (status == OPTIONS_RUN) {
        status = twin_options_check(&command_twin, &settings);
    }
    if (status != OPTIONS_RUN) {
        return status;
    }
    failure_t failure;
    return serve(argv[1], converter, &settings, json, &failure) ? STATUS_DONE : failure_print(&failure);
}

const command_t command_twin = {
    .name = "twin",
    .order = 130,
    .arguments = "MODEL --converter PATH",
    .summary = "Stand in for the actuator, between the amplifier's converters",
    .details = "Runs the model in double precision against the converter line of the bench, sample for sample, until "
               "the line is\n"
               "closed or Ctrl-C. `hyst bench` starts the emulated amplifier and its twin together.",
    .run = run,
    .files = FILE_MODEL "CSV: a recording, as above, of what the twin put out before its converters.\n",
    .examples = "# A twin with sensor noise and a mode at 2 kHz\n"
                "hyst twin twin.json --converter line --noise-um 0.05 --resonance 2000:0.02\n"
                "# In another terminal, in the same folder, an emulator started by hand\n"
                "qemu-system-arm -M netduinoplus2 -kernel bench.elf -display none -serial pty \\\n"
                "    -semihosting-config enable=on,target=native,arg=line.asks,arg=line.answers\n"};
