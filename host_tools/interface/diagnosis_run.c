/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "interface/diagnosis_run.h"
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

/* The ring that stands out most of all recordings. */
static void see_ring(const look_t *looks, size_t count, probe_seen_t *seen) {
    for (size_t i = 0; i < count; i++) {
        const ring_t *ring = &looks[i].ring;
        const size_t samples = looks[i].recording->samples; /* a fault that was undone may have shortened it */
        if (ring->rings > 0 && ring->step[ring->rings - 1] < samples &&
            (seen->rings == 0 || ring->swing_um > seen->ring_um)) {
            seen->rings = ring->rings;
            seen->ring_step = ring->step;
            seen->ring_recording = i;
            seen->ring_hz = ring->frequency_hz / sqrt(1.0 - ring->damping * ring->damping);
            seen->ring_damping = ring->damping;
            seen->ring_um = ring->swing_um;
            seen->ring_near = threshold.same_ring;
        }
    }
}

static bool may_be_held(const look_t *look) {
    const drive_look_t *drive = &look->drive;
    if (drive->between_given) {
        return drive->between == BETWEEN_HELD && recording_key(look->recording, "displacement_sampled_after_s") == NULL;
    }
    return drive->between != BETWEEN_SMOOTH || drive->steps > 0;
}

/* What blocks begin their search with. */
static probe_seen_t seen_by(const look_t *looks, size_t count) {
    probe_seen_t seen = {0};
    double creep = 0.0, weights = 0.0;
    see_ring(looks, count, &seen);
    seen.may_be_held = count > 0;
    for (size_t i = 0; i < count; i++) {
        seen.may_be_held = seen.may_be_held && may_be_held(&looks[i]);
        const response_point_t *peak = response_peak(&looks[i].response);
        seen.peak_hz = seen.peak_hz <= 0.0 && peak != NULL ? peak->frequency_hz : seen.peak_hz;
        if (looks[i].holds.creep_sigma > 0.0) {
            const double weight = 1.0 / (looks[i].holds.creep_sigma * looks[i].holds.creep_sigma);
            creep += weight * looks[i].holds.creep;
            weights += weight;
        }
    }
    seen.creep_per_decade = weights > 0.0 ? creep / weights : 0.0;
    return seen;
}

static bool find_and_account(const model_t *given, recording_t *recordings, size_t count, diagnosis_run_t *run,
                             failure_t *failure) {
    const probe_seen_t seen = seen_by(run->looks, run->looked_at);
    if (!diagnose_seen(given, &seen, recordings, count, &run->answer, failure)) {
        return false;
    }
    for (size_t i = 0; i < count; i++) { /* as the answer takes the drive between samples, so do all that follow */
        recordings[i].held = run->answer.question->recordings[i].held;
        recordings[i].held_since = run->answer.question->recordings[i].held_since;
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
