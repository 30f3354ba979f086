/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "interface/diagnosis_run.h"
#include "diagnosis/excerpt.h"
#include "diagnosis/operator_evidence.h"
#include "look/look_json.h"
#include "look/look_text.h"
#include "report/diagnosis_json.h"
#include "report/diagnosis_report.h"
#include "report/diagnosis_text.h"
#include "thresholds/thresholds.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Evidence of the recordings with one of them set right; its readings are then spread so that no unit changes. */
static bool evidence_undone(const recording_t *recordings, size_t count, const diagnosis_run_t *run,
                            const fault_t *fault, double *log_evidence) {
    recording_t *all = allocate(count, sizeof *all);
    memcpy(all, recordings, count * sizeof *all);
    recording_t *one = &all[fault->recording];
    recording_copy(one, &recordings[fault->recording]);
    const double log_gain = fault->kind->undo(fault, &run->looks[fault->recording], one);
    const double spread = exp(log_gain / (double)one->samples);
    for (size_t k = 0; k < one->samples; k++) {
        one->column[COLUMN_DISPLACEMENT][k] *= spread;
    }
    const bool good = operator_evidence(all, count, log_evidence);
    recording_free(one);
    free(all);
    return good;
}

/* A fault that can be undone is, before physics is looked for, if a hysteresis of any shape then makes the readings
 * likelier. If it does not, there is no such fault: what the look's ruler could not follow was the hysteresis. */
static void undo_faults(recording_t *recordings, size_t count, diagnosis_run_t *run) {
    bool asked = false, possible = false; /* of the recordings as they are now */
    double as_they_are, undone;
    for (size_t f = run->faults.count; f-- > 0;) {
        fault_t *fault = &run->faults.fault[f];
        if (fault->kind->undo == NULL) {
            continue;
        }
        possible = asked ? possible : operator_evidence(recordings, count, &as_they_are);
        asked = true;
        if (!possible || !evidence_undone(recordings, count, run, fault, &undone)) {
            continue;
        }
        if (undone > as_they_are + threshold.evidence_margin) {
            fault->kind->undo(fault, &run->looks[fault->recording], &recordings[fault->recording]);
            fault->undone = true;
            asked = false;
        } else {
            fault_withdraw(&run->faults, f);
        }
    }
}

static bool look_first(recording_t *recordings, size_t count, diagnosis_run_t *run, failure_t *failure) {
    run->looked_at = count;
    for (size_t i = 0; i < count; i++) {
        run->looked_at = recordings[i].samples < LOOK_LEAST_SAMPLES ? 0 : run->looked_at;
    }
    run->looks = looks_at(recordings, run->looked_at, failure);
    if (run->looks == NULL) {
        return false;
    }
    faults_find(run->looks, run->looked_at, &run->faults);
    run->masked = faults_mask(&run->faults, recordings);
    undo_faults(recordings, count, run);
    return true;
}

static void look_away(diagnosis_run_t *run) {
    if (run->looks != NULL) {
        faults_free(&run->faults);
        looks_free(run->looks, run->looked_at);
        run->looks = NULL;
    }
}

static bool find_and_account(const model_t *given, const recording_t *recordings, size_t count, diagnosis_run_t *run,
                             failure_t *failure) {
    if (!diagnose(given, recordings, count, &run->answer, failure)) {
        return false;
    }
    if (!account_for(&run->answer, recordings, count, &run->account, failure)) {
        answer_free(&run->answer);
        return false;
    }
    return true;
}

bool diagnosis_run(const model_t *given, recording_t *recordings, size_t count, diagnosis_run_t *run,
                   failure_t *failure) {
    *run = (diagnosis_run_t){0};
    excerpt(recordings, count, (size_t)threshold.most_samples);
    const bool good =
        look_first(recordings, count, run, failure) && find_and_account(given, recordings, count, run, failure);
    if (!good) {
        look_away(run);
    }
    return good;
}

json_t *diagnosis_run_to_json(const diagnosis_run_t *run, const recording_t *recordings, size_t count) {
    json_t *json = diagnosis_to_json(&run->answer, &run->account, recordings, count);
    looks_into_diagnosis(json, run->looks, run->looked_at, &run->faults, run->masked);
    if (run->sure_asked) {
        json_object_set_new(json, "sure", sure_to_json(&run->sure));
    }
    return json;
}

void diagnosis_run_print(FILE *file, const diagnosis_run_t *run, const recording_t *recordings, size_t count) {
    looks_print_shortly(file, run->looks, run->looked_at, &run->faults, run->masked);
    diagnosis_print(file, &run->answer, &run->account, recordings, count);
    if (run->sure_asked) {
        sure_print(file, &run->sure);
    }
}

bool diagnosis_run_report(const diagnosis_run_t *run, const recording_t *recordings, size_t count, const char *path,
                          failure_t *failure) {
    return diagnosis_write_report(&run->answer, &run->account, recordings, count,
                                  run->looked_at > 0 ? run->looks : NULL, path, failure);
}

void diagnosis_run_free(diagnosis_run_t *run) {
    account_free(&run->account);
    answer_free(&run->answer);
    look_away(run);
}
