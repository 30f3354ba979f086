/* SPDX-License-Identifier: GPL-3.0-or-later */
/** The options of a command that talks to the amplifier. */
#ifndef DEVICE_OPTIONS_H
#define DEVICE_OPTIONS_H

#include "amplifier/device/device.h"
#include "command_line/command_line.h"

/** Lines of an option_t table that fill a device_options_t. */
#define DEVICE_OPTIONS(options)                                                                                        \
    {"--port", "-p", OPTION_TEXT, "DEV", "serial port of the amplifier, for example /dev/ttyUSB0", &(options).port},   \
        {"--baud", NULL, OPTION_COUNT, "N", "bits per second (115200)", &(options).baud},                              \
        {"--parity", NULL, OPTION_TEXT, "none|even|odd", "parity of the line (none)", &(options).parity},              \
        {"--slave", NULL, OPTION_COUNT, "N", "Modbus address (1)", &(options).slave}, {                                \
        "--timeout", NULL, OPTION_NUMBER, "S", "wait for each answer (0.5 s, tried three times)", &(options).timeout_s \
    }

/**
 * options_parse for a command with exactly `arguments` positional arguments, whose option table fills *line; checks the
 * line's options too. Where no amplifier answers, it is looked for elsewhere.
 */
int device_options_parse(const command_t *command, const option_t *options, size_t count, int argc, char **argv,
                         size_t arguments, device_options_t *line);

/** A command without positional arguments that uses the amplifier. Its options fill `settings`. */
typedef struct {
    void *settings;
    device_options_t *line;       /**< in the settings */
    int (*check)(void *settings); /**< OPTIONS_RUN, or the usage error's status after printing it; or NULL */
    bool (*prepare)(void *settings, failure_t *failure); /**< before the port is opened; or NULL */
    /** After SIGINT, SIGTERM or SIGHUP and an orderly end, the process ends by that signal, so that a shell also ends a
     * loop around the command. */
    bool to_its_end;
    bool any_map; /**< device_open_any_map: it makes safe, which it must with any version of the register map */
    int (*work)(device_t *device, void *settings); /**< Returns the exit status */
    /** With that status, once the port is closed: what may take long and needs no line. Returns the exit status; or
     * NULL. */
    int (*after)(void *settings, int status);
} device_work_t;

/** Reads the options, checks, prepares, opens the port, works, closes it, and does the rest. Returns the exit status.
 */
int device_command_run(const command_t *command, const option_t *options, size_t count, int argc, char **argv,
                       const device_work_t *work);

#endif
