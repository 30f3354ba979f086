/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "amplifier/device/line_change.h"
#include "amplifier/device/opening.h"
#include "base/json_output.h"
#include "command_line/device_options.h"
#include "commands/command.h"
#include <limits.h>
#include <stdio.h>

#define AS_IT_IS ULONG_MAX

typedef struct {
    device_options_t line;
    unsigned long address, baud; /* to be set; AS_IT_IS */
    const char *parity;          /* likewise; NULL: as it is */
    bool json;
} settings_t;

static int check(const settings_t *s) {
    if (s->address != AS_IT_IS && (s->address < 1 || s->address > LINE_ADDRESS_MAX)) {
        return usage_error(&command_modbus, "--set-address %lu: outside 1..%u", s->address, LINE_ADDRESS_MAX);
    }
    if (s->baud != AS_IT_IS && (s->baud < LINE_BAUD_MIN || s->baud > LINE_BAUD_MAX)) {
        return usage_error(&command_modbus, "--set-baud %lu: outside %u..%u", s->baud, LINE_BAUD_MIN, LINE_BAUD_MAX);
    }
    device_options_t next = s->line;
    failure_t failure;
    next.baud = s->baud != AS_IT_IS ? s->baud : next.baud;
    if (!device_options_check(&next, &failure)) {
        return usage_error(&command_modbus, "%s", failure.text);
    }
    if (s->parity != NULL && parity_number(s->parity) < 0) {
        return usage_error(&command_modbus, "--set-parity %s: not none, even or odd", s->parity);
    }
    return OPTIONS_RUN;
}

static bool present(const device_options_t *options, line_settings_t *line, failure_t *failure) {
    device_t *device = device_open(options, failure);
    const bool read = device != NULL && line_read(device, line, failure);
    device_close(device);
    return read;
}

static bool show_or_set(const settings_t *s, failure_t *failure) {
    const bool changes = s->address != AS_IT_IS || s->baud != AS_IT_IS || s->parity != NULL;
    line_settings_t line;
    if (!present(&s->line, &line, failure)) {
        return false;
    }
    line.address = s->address != AS_IT_IS ? (uint32_t)s->address : line.address;
    line.baud = s->baud != AS_IT_IS ? (uint32_t)s->baud : line.baud;
    line.parity = s->parity != NULL ? (uint32_t)parity_number(s->parity) : line.parity;
    if (changes && !line_change(&s->line, &line, failure)) {
        return false;
    }
    if (s->json && !json_print(json_pack("{s:s, s:I, s:I, s:s, s:b}", "format", "hyst-modbus-1", "address",
                                         (json_int_t)line.address, "baud", (json_int_t)line.baud, "parity",
                                         parity_name(line.parity), "changed", changes),
                               JSON_INDENT(2), failure)) {
        return false;
    }
    if (text_wanted(s->json)) {
        printf("%saddress %u, %u baud, parity %s\n", changes ? "stored and in force: " : "", (unsigned)line.address,
               (unsigned)line.baud, parity_name(line.parity));
    }
    return true;
}

static int run(int argc, char **argv) {
    settings_t s = {.line = DEVICE_OPTIONS_DEFAULT, .address = AS_IT_IS, .baud = AS_IT_IS};
    const option_t options[] = {
        DEVICE_OPTIONS(s.line),
        {"--set-address", NULL, OPTION_COUNT, "N", "address to have from now on, 1 to 247", &s.address},
        {"--set-baud", NULL, OPTION_COUNT, "N", "bits per second to have from now on, 9600 to 500000", &s.baud},
        {"--set-parity", NULL, OPTION_TEXT, "none|even|odd", "parity to have from now on", &s.parity},
        JSON_OPTION(&s.json),
    };
    int status =
        device_options_parse(&command_modbus, options, sizeof options / sizeof options[0], argc, argv, 0, &s.line);
    if (status == OPTIONS_RUN) {
        status = check(&s);
    }
    if (status != OPTIONS_RUN) {
        return status;
    }
    failure_t failure;
    return show_or_set(&s, &failure) ? STATUS_DONE : failure_print(&failure);
}

const command_t command_modbus = {
    .name = "modbus",
    .order = 118,
    .arguments = "--port DEV [--set-address N] [--set-baud N] [--set-parity P]",
    .summary = "Show or set address, rate and parity of the amplifier's Modbus line",
    .details =
        "What is set is stored in the amplifier, beside its parameters, and in force as soon as it has answered; "
        "the others stay.\n"
        "The amplifier has to be off. It has to answer at the new settings. From then on every "
        "command needs\n"
        "--slave, --baud and --parity as they are now. Who has forgotten them starts the amplifier with its "
        "button held\n"
        "(docs/WIRING.md): it has address 1, 115200 baud and no parity until the next start.",
    .run = run,
    .examples = "# Which settings does it have?\n"
                "hyst modbus --port /dev/ttyUSB0\n"
                "# A second amplifier on one line\n"
                "hyst modbus --port /dev/ttyUSB0 --set-address 2\n"
                "# What the Modbus standard has for a default, and from then on\n"
                "hyst modbus --port /dev/ttyUSB0 --set-baud 19200 --set-parity even\n"
                "hyst info --port /dev/ttyUSB0 --baud 19200 --parity even\n"};
