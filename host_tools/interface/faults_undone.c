/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "interface/faults_undone.h"
#include "diagnosis/question/operator_evidence.h"
#include "numerics/size_search.h"
#include "thresholds/thresholds.h"
#include <math.h>
#include <string.h>

size_t readings_that_count(const recording_t *recording) {
    size_t count = 0;
    for (size_t k = 0; k < recording->samples; k++) {
        count += recording->masked == NULL || recording->masked[k] == 0 ? 1 : 0;
    }
    return count;
}

/* How likely a recording's readings are with a fault undone; they are spread so that no unit changes. Readings that are
 * left out when it is undone count as the others do in the mean. A recording is judged by itself: what another one has
 * is no reason for or against a fault of this one. */
static bool evidence_undone(const recording_t *recording, const look_t *look, const fault_t *fault,
                            double *log_evidence) {
    recording_t one;
    recording_copy(&one, recording, 0, recording->samples);
    const double log_gain = fault->kind->undo(fault, look, &one);
    const double spread = exp(log_gain / (double)one.samples);
    for (size_t k = 0; k < one.samples; k++) {
        one.column[COLUMN_DISPLACEMENT][k] *= spread;
    }
    const bool good = operator_evidence(&one, 1, log_evidence);
    *log_evidence *= (double)readings_that_count(recording) / (double)readings_that_count(&one);
    recording_free(&one);
    return good;
}

/* The same in the likeliest of the forms that the fault may have, which it then has. */
static bool evidence_of_likeliest(const recording_t *recording, const look_t *look, fault_t *fault,
                                  double *log_evidence) {
    double size[FAULT_MOST_CHOICES];
    const size_t choices = fault->kind->choices != NULL ? fault->kind->choices(fault, size) : 0;
    size_t best = choices;
    for (size_t i = 0; i < choices; i++) {
        double here;
        fault->kind->resize(fault, look, size[i]);
        if (evidence_undone(recording, look, fault, &here) && (best == choices || here > *log_evidence)) {
            *log_evidence = here;
            best = i;
        }
    }
    if (best < choices) {
        fault->kind->resize(fault, look, size[best]);
    }
    return choices > 0 ? best < choices : evidence_undone(recording, look, fault, log_evidence);
}

/* A fault that can be undone is, before physics is looked for, if a hysteresis of any shape then makes the readings
 * likelier. If it does not, there is no such fault: what the look's ruler could not follow was the hysteresis. The look
 * has chosen its instant among all, so it has to be worth what the best of many probes has to be: what physics adds is
 * not the same everywhere, either. */
static void undo_faults_of(recording_t *recording, const look_t *look, size_t index, fault_list_t *faults) {
    bool asked = false, possible = false;
    double as_they_are, undone;
    for (size_t f = faults->count; f-- > 0;) {
        fault_t *fault = &faults->fault[f];
        if (fault->recording != index || fault->kind->undo == NULL) {
            continue;
        }
        possible = asked ? possible : operator_evidence(recording, 1, &as_they_are);
        asked = true;
        if (!possible || !evidence_of_likeliest(recording, look, fault, &undone)) {
            continue;
        }
        if (undone > as_they_are + threshold.least_gain) {
            fault->kind->undo(fault, look, recording);
            fault->undone = true;
            as_they_are = undone;
        } else {
            fault_withdraw(faults, f);
        }
    }
}

typedef struct {
    const recording_t *recording;
    const look_t *look;
    const fault_t *fault; /* of any size */
} suspicion_t;

/* Less is likelier. */
static double unlikely(void *context, double size) {
    const suspicion_t *suspicion = context;
    fault_t fault = *suspicion->fault;
    double log_evidence;
    fault.kind->resize(&fault, suspicion->look, size);
    return evidence_undone(suspicion->recording, suspicion->look, &fault, &log_evidence) ? -log_evidence : HUGE_VAL;
}

/* A fault of some size that the look's statistic cannot tell, and the readings may. It is not undone yet. */
static void suspect(const fault_kind_t *kind, const recording_t *recording, const look_t *look, size_t index,
                    fault_list_t *faults) {
    double size, as_they_are, least;
    if (fault_found(faults, kind, index) || !kind->suspect(look, &size) ||
        !operator_evidence(recording, 1, &as_they_are)) {
        return;
    }
    fault_t fault = {.kind = kind, .recording = index};
    suspicion_t suspicion = {recording, look, &fault};
    fault.kind->resize(&fault, look, size_search(unlikely, &suspicion, size, &least));
    const double gain = -least - as_they_are;
    fault_t *added = gain > threshold.evidence_margin ? fault_add(faults, kind, index, gain, -gain / log(10.0)) : NULL;
    if (added != NULL) {
        memcpy(added->number, fault.number, sizeof fault.number);
        added->numbers = fault.numbers;
        added->suspected = true;
    }
}

void faults_undo(recording_t *recordings, const look_t *looks, size_t count, fault_list_t *faults,
                 progress_t *progress) {
    for (size_t i = 0; i < count; i++) {
        progress_update(progress, (double)i / (double)count);
        undo_faults_of(&recordings[i], &looks[i], i, faults);
        for (size_t k = 0; k < fault_kind_count; k++) {
            if (fault_kinds[k]->suspect != NULL) {
                suspect(fault_kinds[k], &recordings[i], &looks[i], i, faults);
            }
        }
    }
}

bool faults_some_suspected(const fault_list_t *faults) {
    for (size_t f = 0; f < faults->count; f++) {
        if (faults->fault[f].suspected) {
            return true;
        }
    }
    return false;
}

void faults_undo_suspected(recording_t *recordings, const look_t *looks, fault_list_t *faults) {
    for (size_t f = 0; f < faults->count; f++) {
        fault_t *fault = &faults->fault[f];
        if (fault->suspected) {
            fault->kind->undo(fault, &looks[fault->recording], &recordings[fault->recording]);
            fault->undone = true;
        }
    }
}

void faults_withdraw_suspected(fault_list_t *faults) {
    for (size_t f = faults->count; f-- > 0;) {
        if (faults->fault[f].suspected) {
            fault_withdraw(faults, f);
            faults->withdrawn--; /* no look has told it */
        }
    }
}
