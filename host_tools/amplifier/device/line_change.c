/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "amplifier/device/line_change.h"
#include "amplifier/device/arming.h"
#include "amplifier/device/opening.h"
#include "store/parameter_store.h"
#include <inttypes.h>
#include <string.h>

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
    return device_expect_off(device, "its line", failure) && device_unlock(device, CONTROL_PARAMETERS, failure) &&
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
    const bool read = device != NULL && line_read(device, &held, failure) &&
                      device_read(device, INDEX_store_state, &state, failure) &&
                      device_write(device, INDEX_unlock, 0, failure);
    device_close(device);
    return read && ((state == STORE_SAVED && held.address == line->address && held.baud == line->baud &&
                     held.parity == line->parity) ||
                    fail(failure, "%s: another amplifier, or one with other settings, answers at address %lu",
                         options->port, options->slave));
}

/* It does not answer at the new settings: says where it is. */
static bool whereabouts(const device_options_t *now, const line_settings_t *line, failure_t *failure) {
    failure_t why = *failure;
    device_t *device = device_open(now, failure);
    int64_t state = STORE_NONE;
    const bool there = device != NULL && device_read(device, INDEX_store_state, &state, failure);
    device_close(device);
    if (there && state == STORE_FAILED) {
        return fail(failure,
                    "%s: the amplifier did not store the settings of the line, and has the old ones: its "
                    "flash did not take them",
                    now->port);
    }
    if (there) {
        return fail(failure, "%s: the amplifier still has the old settings of the line; nothing was changed: try again",
                    now->port);
    }
    return fail(failure,
                "%.300s. The amplifier has address %lu, %lu baud, parity %s, or address %u, %u baud, parity %s: ask "
                "`hyst info` with both when the line is good, or start it with its button held (docs/WIRING.md)",
                why.text, now->slave, now->baud, now->parity, (unsigned)line->address, (unsigned)line->baud,
                parity_name(line->parity));
}

/* How many copies the amplifier has stored. */
static bool copies(device_t *device, int64_t *count, failure_t *failure) {
    return device_read(device, INDEX_store_sequence, count, failure);
}

static bool same(const device_options_t *now, const device_options_t *next) {
    return now->baud == next->baud && now->slave == next->slave && strcmp(now->parity, next->parity) == 0;
}

bool line_change(const device_options_t *now, const line_settings_t *line, failure_t *failure) {
    device_options_t here = *now;
    here.look_elsewhere = false; /* it is here or there */
    device_options_t next = here;
    next.baud = line->baud;
    next.slave = line->address;
    next.parity = parity_name(line->parity);
    device_t *device = device_open(now, failure);
    if (device == NULL) {
        return false;
    }
    int64_t before = 0, since = 0;
    const bool known = copies(device, &before, failure);
    const bool stored = known && note_and_store(device, line, failure);
    failure_t silent;
    const bool is_there = !stored && copies(device, &since, &silent); /* refused, or it had these settings already */
    if (!is_there) {
        device_forget_locks(device); /* it no longer answers there */
    }
    device_close(device);
    if (is_there) {
        return known && same(now, &next) && since != before;
    }
    return has(&next, line, failure) || (!same(now, &next) && whereabouts(&here, line, failure));
}
