/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "amplifier/device/opening.h"
#include "amplifier/device/device_state.h"
#include "amplifier/device/register_words.h"
#include "amplifier/device/restart.h"
#include "amplifier/line/line_search.h"
#include "base/provenance.h"
#include <stdio.h>
#include <stdlib.h>

/* An earlier client may have ended while it waited, and its late answer could be read here. An unexpected value is
 * therefore read again once the line is silent. */
static line_outcome_t read_expected(device_t *device, int which, uint16_t expected, uint16_t *value, bool *silent,
                                    failure_t *failure) {
    char what[100];
    (void)snprintf(what, sizeof what, "register %s", register_table[which].name);
    const request_t request = {.what = what, .address = register_table[which].address, .count = 1, .read = value};
    const line_outcome_t outcome = serial_line_request(&device->line, &request, REGISTER_TRIES, silent, failure);
    if (outcome != LINE_DONE || *value == expected) {
        return outcome;
    }
    serial_line_settle(&device->line);
    return serial_line_request(&device->line, &request, REGISTER_TRIES, silent, failure);
}

/* silent: set when the first request had no answer at all. */
static bool check_magic(device_t *device, bool *silent, failure_t *failure) {
    uint16_t magic = 0;
    switch (read_expected(device, INDEX_magic, REGISTERS_MAGIC, &magic, silent, failure)) {
    case LINE_DONE:
        break;
    case LINE_REFUSED:
        return fail_in(failure, "%s is not a hyst amplifier", device->line.port);
    default:
        return false;
    }
    device->identity[INDEX_magic] = magic;
    return magic == REGISTERS_MAGIC || fail(failure, "%s is not a hyst amplifier: register magic is 0x%04X, not 0x%04X",
                                            device->line.port, (unsigned)magic, (unsigned)REGISTERS_MAGIC);
}

/* Only magic, abi and what makes safe mean the same in every version of the map (registers.def). */
static bool check_identity(device_t *device, bool any_map, bool *silent, failure_t *failure) {
    uint16_t abi = 0;
    if (!check_magic(device, silent, failure) ||
        read_expected(device, INDEX_abi, REGISTERS_ABI, &abi, NULL, failure) != LINE_DONE) {
        return false;
    }
    device->identity[INDEX_abi] = abi;
    device->map_known = abi == REGISTERS_ABI;
    if (!device->map_known && any_map) {
        return true;
    }
    return device_expect_known_map(device, failure) &&
           device_read_span(device, INDEX_magic, INDEX_serial_low, device->identity, failure);
}

/* For what results say of their origin. */
static void note_device(const device_t *device) {
    char text[DEVICE_TEXT + 300], itself[DEVICE_TEXT];
    device_text(device, itself);
    (void)snprintf(text, sizeof text, "%s, at %s, address %lu", itself, device->line.port, device->line.slave);
    provenance_set_device(text);
}

/* Adds to the line that there was no answer where there is one. */
static void say_where(const device_options_t *options, failure_t *failure) {
    const failure_t silence = *failure;
    device_options_t found;
    if (line_search(options, &found)) {
        (void)fail(failure,
                   "%.400s, at %lu baud, parity %s. An amplifier answers with --baud %lu --parity %s --slave %lu",
                   silence.text, options->baud, options->parity, found.baud, found.parity, found.slave);
    } else {
        (void)fail(failure, "%.400s, at %lu baud, parity %s, nor at another rate or parity", silence.text,
                   options->baud, options->parity);
    }
}

static device_t *open_device(const device_options_t *options, bool any_map, failure_t *failure) {
    device_t *device = allocate(1, sizeof *device);
    bool silent = false;
    if (!serial_line_open(&device->line, options, failure) || !check_identity(device, any_map, &silent, failure)) {
        device_close(device);
        if (silent && options->look_elsewhere) {
            say_where(options, failure);
        }
        return NULL;
    }
    if (device->map_known) {
        note_device(device);
        device_note_start(device);
    }
    return device;
}

device_t *device_open(const device_options_t *options, failure_t *failure) {
    return open_device(options, false, failure);
}

device_t *device_open_any_map(const device_options_t *options, failure_t *failure) {
    return open_device(options, true, failure);
}

void device_close(device_t *device) {
    if (device == NULL) {
        return;
    }
    device_lock(device);
    serial_line_close(&device->line);
    free(device);
}

void device_leave_to_parent(const device_t *device) {
    serial_line_leave_to_parent(&device->line);
}
