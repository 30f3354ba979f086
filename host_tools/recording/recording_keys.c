/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What header keys of a recording say, and whether they may say it. */
#include "recording/recording.h"
#include "recording/table/decimal.h"
#include <math.h>
#include <string.h>

const char *drive_between_name(drive_between_t between) {
    static const char *const names[] = {"unknown", "held", "line", "smooth"};
    return names[between];
}

bool recording_drive_between(const recording_t *recording, drive_between_t *between, failure_t *failure) {
    const char *key = recording_key(recording, "drive_between_samples");
    *between = BETWEEN_UNKNOWN;
    for (drive_between_t b = BETWEEN_HELD; key != NULL && b <= BETWEEN_SMOOTH; b++) {
        *between = strcmp(key, drive_between_name(b)) == 0 ? b : *between;
    }
    return key == NULL || *between != BETWEEN_UNKNOWN ||
           fail(failure, "%s: header key drive_between_samples is '%s', not held, line or smooth", recording->name,
                key);
}

bool recording_preload(const recording_t *recording, double *preload_n, failure_t *failure) {
    const char *text = recording_key(recording, "preload_n");
    *preload_n = 0.0;
    if (text != NULL && !(decimal_is(text, preload_n) && *preload_n >= 0.0)) {
        return fail(failure, "%s: header key preload_n is '%s', not a force of 0 N or more", recording->name, text);
    }
    return true;
}

bool recording_sampled_after(const recording_t *recording, double *after_s, failure_t *failure) {
    const char *text = recording_key(recording, "displacement_sampled_after_s");
    *after_s = 0.0;
    if (text != NULL && !(decimal_is(text, after_s) && isfinite(*after_s))) {
        return fail(failure, "%s: header key displacement_sampled_after_s is '%s', not a number of seconds",
                    recording->name, text);
    }
    return true;
}

bool recording_stage_supply(const recording_t *recording, double *supply_v, failure_t *failure) {
    const char *text = recording_key(recording, STAGE_SUPPLY_KEY);
    *supply_v = HUGE_VAL;
    if (text != NULL && !(decimal_is(text, supply_v) && isfinite(*supply_v) && *supply_v > 0.0)) {
        return fail(failure, "%s: header key " STAGE_SUPPLY_KEY " is '%s', not a voltage above 0 V", recording->name,
                    text);
    }
    return true;
}

bool recording_check_keys(const recording_t *recording, failure_t *failure) {
    drive_between_t between;
    double number, before_v[RECORDING_MOST_BEFORE];
    size_t points;
    return recording_drive_between(recording, &between, failure) && recording_preload(recording, &number, failure) &&
           recording_sampled_after(recording, &number, failure) &&
           recording_stage_supply(recording, &number, failure) &&
           recording_drive_before(recording, before_v, &points, failure);
}
