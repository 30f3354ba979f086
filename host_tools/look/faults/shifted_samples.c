/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Instants from which on the position is early or late by whole samples: look/path/shifts.h. */
#include "look/fault.h"
#include <math.h>
#include <string.h>

/* Shifts in one direction. direction: 1 early (readings lost), -1 late (readings written twice). */
static void find(const look_t *looks, size_t count, const fault_kind_t *kind, int direction, fault_list_t *faults) {
    for (size_t i = 0; i < count; i++) {
        const changes_t *changes = &looks[i].changes;
        double all = 0.0, log_chance = 0.0;
        for (size_t s = 0; s < changes->shifts; s++) {
            const double samples = direction * (double)changes->shift[s].samples;
            if (samples > 0.0) {
                all += samples;
                log_chance = fmin(log_chance, changes->shift[s].log_chance);
            }
        }
        fault_t *fault = fault_add(faults, kind, i, changes->before_um / changes->left_um, log_chance);
        if (fault == NULL) {
            continue;
        }
        for (size_t s = 0; s < changes->shifts; s++) {
            const shift_t *shift = &changes->shift[s];
            if (direction * (double)shift->samples > 0.0) {
                fault_span(fault, shift->at - shift->within, shift->at + shift->within + 1);
            }
        }
        fault_number(fault, "samples", "1", all, 0.0);
        fault_number(fault, "instants", "1", (double)fault->spans, 0.0);
    }
}

static void find_dropped(const look_t *looks, size_t count, const fault_kind_t *kind, fault_list_t *faults) {
    find(looks, count, kind, 1, faults);
}

static void find_repeated(const look_t *looks, size_t count, const fault_kind_t *kind, fault_list_t *faults) {
    find(looks, count, kind, -1, faults);
}

/* The readings from a row on to another one, and what was left out of them. */
static void move_readings(recording_t *recording, size_t from, size_t to) {
    double *y = recording->column[COLUMN_DISPLACEMENT];
    unsigned char *masked = recording->masked;
    const size_t count = recording->samples - (from > to ? from : to);
    memmove(y + to, y + from, count * sizeof *y);
    if (masked != NULL) {
        memmove(masked + to, masked + from, count);
    }
}

static void mask_rows(recording_t *recording, size_t from, size_t to) {
    recording_mask(recording, from, to < recording->samples ? to : recording->samples);
}

/* From the last instant to the first, so that each is where the look has found it. Around an instant, as far as it is
 * not known, readings may stand wrong: they are left out with the rows that have none. */
static double put_back(const look_t *look, int direction, recording_t *recording) {
    const changes_t *changes = &look->changes;
    const size_t n = recording->samples;
    size_t below = n;
    for (size_t left = changes->shifts; left > 0; left--) {
        const shift_t *last = NULL;
        for (size_t s = 0; s < changes->shifts; s++) {
            const shift_t *shift = &changes->shift[s];
            const bool next = shift->at < below && (last == NULL || shift->at > last->at);
            last = next && direction * shift->samples > 0 ? shift : last;
        }
        if (last == NULL) {
            break;
        }
        const int readings = direction * last->samples;
        const size_t at = last->at, by = (size_t)readings, from = at > last->within ? at - last->within : 0;
        below = at;
        if (at + by < n && direction > 0) {
            move_readings(recording, at, at + by);
            mask_rows(recording, from, at + by + last->within);
        } else if (at + by < n) {
            move_readings(recording, at + by, at);
            mask_rows(recording, from, at + last->within);
            mask_rows(recording, n - by, n);
        }
    }
    return 0.0;
}

static double undo_dropped(const fault_t *fault, const look_t *look, recording_t *recording) {
    (void)fault;
    return put_back(look, 1, recording);
}

static double undo_repeated(const fault_t *fault, const look_t *look, recording_t *recording) {
    (void)fault;
    return put_back(look, -1, recording);
}

const fault_kind_t fault_dropped_samples = {
    .name = "dropped_samples",
    .order = 90,
    .text = "Readings of the position were lost: from there on it is early beside the drive.",
    .statistic = "what the reference leaves before, over what it leaves after the readings are put back in place",
    .change = "Look for overruns of the sensor's buffer or bus; write both columns from one buffer, with a counter. "
              "Fit the parts apart, or put the lost readings back.",
    .handling = FAULT_MODELLABLE,
    .find = find_dropped,
    .undo = undo_dropped};

const fault_kind_t fault_repeated_samples = {
    .name = "repeated_samples",
    .order = 100,
    .text = "Readings of the position were written twice: from there on it is late beside the drive.",
    .statistic = "what the reference leaves before, over what it leaves after the readings are put back in place",
    .change = "Look for a buffer that is read again when no new one is there; write both columns from one buffer, with "
              "a counter. Fit the parts apart, or take the copies out.",
    .handling = FAULT_MODELLABLE,
    .find = find_repeated,
    .undo = undo_repeated};
