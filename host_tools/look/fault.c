/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "look/fault.h"
#include <stdlib.h>
#include <string.h>

#define FAULT_ADDRESS(name) &fault_##name,
const fault_kind_t *const fault_kinds[] = {FAULT_KIND_LIST(FAULT_ADDRESS)};
#undef FAULT_ADDRESS
const size_t fault_kind_count = sizeof fault_kinds / sizeof fault_kinds[0];

/* Of a recording that has a fault which stands alone, the others. */
static void leave_others_out(fault_list_t *faults) {
    size_t kept = 0;
    for (size_t i = 0; i < faults->count; i++) {
        bool other = false;
        for (size_t j = 0; j < kept; j++) { /* such kinds are the first in the order */
            other = other || (faults->fault[j].kind->alone && faults->fault[j].recording == faults->fault[i].recording);
        }
        if (other) {
            free(faults->fault[i].span);
        } else {
            faults->fault[kept++] = faults->fault[i];
        }
    }
    faults->count = kept;
}

void faults_find(const look_t *looks, size_t count, fault_list_t *faults) {
    memset(faults, 0, sizeof *faults);
    for (size_t i = 0; i < fault_kind_count; i++) {
        fault_kinds[i]->find(looks, count, fault_kinds[i], faults);
    }
    leave_others_out(faults);
}

void faults_free(fault_list_t *faults) {
    for (size_t i = 0; i < faults->count; i++) {
        free(faults->fault[i].span);
    }
    free(faults->fault);
    memset(faults, 0, sizeof *faults);
}

fault_t *fault_add(fault_list_t *faults, const fault_kind_t *kind, size_t recording, double evidence,
                   double log_chance) {
    if (!(log_chance < look_log_chance_limit())) {
        return NULL;
    }
    faults->fault = reallocate(faults->fault, faults->count + 1, sizeof *faults->fault);
    fault_t *fault = &faults->fault[faults->count++];
    *fault = (fault_t){.kind = kind, .recording = recording, .evidence = evidence, .log_chance = log_chance};
    return fault;
}

void fault_number(fault_t *fault, const char *name, const char *unit, double value, double sigma) {
    if (fault->numbers < FAULT_MOST_NUMBERS) {
        fault->number[fault->numbers++] = (fault_number_t){name, unit, value, sigma};
    }
}

void fault_span(fault_t *fault, size_t from, size_t to) {
    fault->span = reallocate(fault->span, fault->spans + 1, sizeof *fault->span);
    fault->span[fault->spans++] = (look_span_t){from, to};
}

bool fault_found(const fault_list_t *faults, const fault_kind_t *kind, size_t recording) {
    for (size_t i = 0; i < faults->count; i++) {
        if (faults->fault[i].kind == kind && faults->fault[i].recording == recording) {
            return true;
        }
    }
    return false;
}

size_t faults_mask(const fault_list_t *faults, recording_t *recordings) {
    size_t masked = 0;
    for (size_t i = 0; i < faults->count; i++) {
        const fault_t *fault = &faults->fault[i];
        for (size_t s = 0; fault->kind->handling == FAULT_MASKABLE && s < fault->spans; s++) {
            recording_mask(&recordings[fault->recording], fault->span[s].from, fault->span[s].to);
            masked += span_length(fault->span[s]);
        }
    }
    return masked;
}

void fault_withdraw(fault_list_t *faults, size_t index) {
    free(faults->fault[index].span);
    faults->count--;
    faults->withdrawn++;
    memmove(&faults->fault[index], &faults->fault[index + 1], (faults->count - index) * sizeof faults->fault[0]);
}

const char *fault_handling_name(fault_handling_t handling) {
    static const char *const names[] = {"maskable", "modellable", "fatal"};
    return names[handling];
}

size_t fault_samples(const fault_t *fault, const look_t *looks) {
    size_t samples = 0;
    for (size_t i = 0; i < fault->spans; i++) {
        samples += span_length(fault->span[i]);
    }
    return fault->spans > 0 ? samples : looks[fault->recording].recording->samples;
}
