/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Instants from which on the position is early or late by whole samples: look/changes.h. */
#include "look/fault.h"
#include <math.h>

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

const fault_kind_t fault_dropped_samples = {
    .name = "dropped_samples",
    .order = 90,
    .text = "Readings of the position were lost: from there on it is early beside the drive.",
    .statistic = "what the reference leaves before, over what it leaves after the readings are put back in place",
    .change = "Look for overruns of the sensor's buffer or bus; write both columns from one buffer, with a counter. "
              "Fit the parts apart, or put the lost readings back.",
    .handling = FAULT_MODELLABLE,
    .find = find_dropped};

const fault_kind_t fault_repeated_samples = {
    .name = "repeated_samples",
    .order = 100,
    .text = "Readings of the position were written twice: from there on it is late beside the drive.",
    .statistic = "what the reference leaves before, over what it leaves after the readings are put back in place",
    .change = "Look for a buffer that is read again when no new one is there; write both columns from one buffer, with "
              "a counter. Fit the parts apart, or take the copies out.",
    .handling = FAULT_MODELLABLE,
    .find = find_repeated};
