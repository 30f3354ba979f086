/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "command_line/device_options.h"
#include "amplifier/device/opening.h"
#include "base/stop_signal.h"
#include "command_line/print.h"
#include <signal.h>
#include <stdio.h>

static int check_line(const command_t *command, const device_options_t *options) {
    failure_t failure;
    return device_options_check(options, &failure) ? OPTIONS_RUN : usage_error(command, "%s", failure.text);
}

int device_options_parse(const command_t *command, const option_t *options, size_t count, int argc, char **argv,
                         size_t arguments, device_options_t *line) {
    size_t positionals = 0;
    line->look_elsewhere = true;
    const int status = options_parse(command, options, count, argc, argv, arguments, arguments, &positionals);
    return status == OPTIONS_RUN ? check_line(command, line) : status;
}

/* Does not return if one of the signals has come. */
static void end_by_signal(void) {
    const int number = stop_signal();
    if (number != 0) {
        (void)fflush(NULL);
        struct sigaction action = {.sa_handler = SIG_DFL};
        (void)sigemptyset(&action.sa_mask);
        (void)sigaction(number, &action, NULL);
        (void)raise(number);
    }
}

int device_command_run(const command_t *command, const option_t *options, size_t count, int argc, char **argv,
                       const device_work_t *work) {
    failure_t failure;
    int status = device_options_parse(command, options, count, argc, argv, 0, work->line);
    if (status == OPTIONS_RUN && work->check != NULL) {
        status = work->check(work->settings);
    }
    if (status != OPTIONS_RUN) {
        return status;
    }
    device_t *const device = work->prepare != NULL && !work->prepare(work->settings, &failure) ? NULL
                             : work->any_map ? device_open_any_map(work->line, &failure)
                                             : device_open(work->line, &failure);
    if (device == NULL) {
        return failure_print(&failure);
    }
    status = work->work(device, work->settings);
    device_close(device);
    if (work->after != NULL) {
        status = work->after(work->settings, status);
    }
    if (work->to_its_end) {
        end_by_signal();
    }
    return status;
}
