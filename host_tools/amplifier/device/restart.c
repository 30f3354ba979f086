/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "amplifier/device/restart.h"
#include "amplifier/device/device_state.h"
#include "amplifier/device/register_words.h"
#include "amplifier/device/sample_number.h"

static bool read_start(device_t *device, int64_t now[REGISTER_COUNT], failure_t *failure) {
    return register_words_read(&device->line, INDEX_sequence, INDEX_sequence, now, failure) &&
           register_words_read(&device->line, INDEX_reset_cause, INDEX_events, now, failure);
}

static void keep_start(device_t *device, const int64_t now[REGISTER_COUNT]) {
    device->seen[INDEX_starts] = now[INDEX_starts];
    device->seen[INDEX_events] = now[INDEX_events];
    device->seen[INDEX_sequence] = now[INDEX_sequence];
    device->starts_known = true;
}

void device_note_start(device_t *device) {
    int64_t now[REGISTER_COUNT];
    failure_t ignored; /* a line that fails fails in the next request */
    if (read_start(device, now, &ignored)) {
        keep_start(device, now);
    }
}

/* The count of starts begins anew with the supply, so it alone does not tell. Says so once. */
static bool has_restarted(device_t *device, const int64_t now[REGISTER_COUNT]) {
    const int64_t *const seen = device->seen;
    const bool restarted = now[INDEX_starts] != seen[INDEX_starts] || now[INDEX_events] < seen[INDEX_events] ||
                           samples_between(seen[INDEX_sequence], now[INDEX_sequence]) < 0;
    keep_start(device, now);
    return restarted;
}

static bool say_restart(failure_t *failure) {
    return fail(failure, "the amplifier restarted: what was set in it and not stored is gone");
}

bool device_check_start(device_t *device, failure_t *failure) {
    int64_t now[REGISTER_COUNT];
    return !device->starts_known ||
           (read_start(device, now, failure) && (!has_restarted(device, now) || say_restart(failure)));
}

void device_blame_restart(device_t *device, failure_t *failure) {
    int64_t now[REGISTER_COUNT];
    failure_t ignored;
    if (device->starts_known && read_start(device, now, &ignored) && has_restarted(device, now)) {
        (void)say_restart(failure);
    }
}
