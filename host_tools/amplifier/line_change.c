/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "amplifier/line_change.h"
#include "parameter_store.h"
#include "telemetry.h"
#include <inttypes.h>

bool line_read(device_t *device, line_settings_t *line, failure_t *failure) {
    int64_t value[REGISTER_COUNT];
    if (!device_read_span(device, INDEX_line_address, INDEX_line_parity, value, failure)) {
        return false;
    }
    *line = (line_settings_t){.address = (uint32_t)value[INDEX_line_address],
                              .baud = (uint32_t)value[INDEX_line_baud],
                              .parity = (uint32_t)value[INDEX_line_parity]};
    return true;
}

static bool note_and_store(device_t *device, const line_settings_t *line, failure_t *failure) {
    int64_t state = 0;
    if (!device_read(device, INDEX_amplifier_state, &state, failure)) {
        return false;
    }
    if (state != AMPLIFIER_OFF) {
        return fail(failure, "the amplifier is on, and stores its line only while it is off: disarm it (command 10)");
    }
    return device_unlock(device, CONTROL_PARAMETERS, failure) &&
           device_write(device, INDEX_line_address, line->address, failure) &&
           device_write(device, INDEX_line_baud, line->baud, failure) &&
           device_write(device, INDEX_line_parity, line->parity, failure) &&
           device_command(device, COMMAND_SAVE_LINE, failure);
}

/* Whether the amplifier answers there and has stored these settings; it is locked again. */
static bool has(const device_options_t *options, const line_settings_t *line, failure_t *failure) {
    device_t *device = device_open(options, failure);
    line_settings_t held;
    int64_t state = STORE_NONE;
    bool ok = device != NULL && line_read(device, &held, failure) &&
              device_read(device, INDEX_store_state, &state, failure) && device_write(device, INDEX_unlock, 0, failure);
    device_close(device);
    if (ok && (state != STORE_SAVED || held.address != line->address || held.baud != line->baud ||
               held.parity != line->parity)) {
        ok = fail(failure, "%s: the amplifier did not store the settings of the line (store_state %" PRId64 ")",
                  options->port, state);
    }
    return ok;
}

bool line_change(const device_options_t *now, const line_settings_t *line, failure_t *failure) {
    device_options_t next = *now;
    failure_t ignored;
    next.baud = line->baud;
    next.slave = line->address;
    next.parity = parity_name(line->parity);
    device_t *device = device_open(now, failure);
    if (device == NULL) {
        return false;
    }
    const bool stored = note_and_store(device, line, failure);
    line_settings_t held;
    const bool is_there = !stored && line_read(device, &held, &ignored); /* refused, and still as before */
    if (stored) {
        device_forget_locks(device); /* it no longer answers there */
    }
    device_close(device);
    return !is_there && has(&next, line, failure);
}
