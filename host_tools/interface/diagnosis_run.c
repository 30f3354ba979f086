/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "interface/diagnosis_run.h"
#include "base/progress.h"
#include "diagnosis/question/excerpt.h"
#include "diagnosis/question/operator_evidence.h"
#include "look/held_readings.h"
#include "look/look_json.h"
#include "look/look_text.h"
#include "numerics/size_search.h"
#include "report/diagnosis_json.h"
#include "report/diagnosis_print.h"
#include "report/diagnosis_report.h"
#include "thresholds/thresholds.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static size_t readings_that_count(const recording_t *recording) {
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

/* Undone, if it is likelier so by a margin; *as_they_are is then that. */
static bool undo_if_likelier(recording_t *recording, const look_t *look, fault_t *fault, double margin, double undone,
                             double *as_they_are) {
    if (!(undone > *as_they_are + margin)) {
        return false;
    }
    fault->kind->undo(fault, look, recording);
    fault->undone = true;
    *as_they_are = undone;
    return true;
}

/* A fault that can be undone is, before physics is looked for, if a hysteresis of any shape then makes the readings
 * likelier. If it does not, there is no such fault: what the look's ruler could not follow was the hysteresis. The look
 * has chosen its instant among all, so it has to be worth what the best of many probes has to be: what physics adds is
 * not the same everywhere, either. */
static void undo_faults_of(recording_t *recording, size_t index, diagnosis_run_t *run) {
    const look_t *look = &run->looks[index];
    bool asked = false, possible = false;
    double as_they_are, undone;
    for (size_t f = run->faults.count; f-- > 0;) {
        fault_t *fault = &run->faults.fault[f];
        if (fault->recording != index || fault->kind->undo == NULL) {
            continue;
        }
        possible = asked ? possible : operator_evidence(recording, 1, &as_they_are);
        asked = true;
        if (possible && evidence_of_likeliest(recording, look, fault, &undone) &&
            !undo_if_likelier(recording, look, fault, threshold.least_gain, undone, &as_they_are)) {
            fault_withdraw(&run->faults, f);
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

/* A fault of some size that the look's statistic cannot tell, and the readings can. */
static void undo_suspected(const fault_kind_t *kind, recording_t *recording, size_t index, diagnosis_run_t *run) {
    const look_t *look = &run->looks[index];
    double size, as_they_are, least;
    if (fault_found(&run->faults, kind, index) || !kind->suspect(look, &size) ||
        !operator_evidence(recording, 1, &as_they_are)) {
        return;
    }
    fault_t fault = {.kind = kind, .recording = index};
    suspicion_t suspicion = {recording, look, &fault};
    fault.kind->resize(&fault, look, size_search(unlikely, &suspicion, size, &least));
    const double undone = -least, gain = undone - as_they_are;
    fault_t *added =
        gain > threshold.evidence_margin ? fault_add(&run->faults, kind, index, gain, -gain / log(10.0)) : NULL;
    if (added != NULL) {
        memcpy(added->number, fault.number, sizeof fault.number);
        added->numbers = fault.numbers;
        (void)undo_if_likelier(recording, look, added, threshold.evidence_margin, undone, &as_they_are);
    }
}

static void undo_faults(recording_t *recordings, diagnosis_run_t *run, progress_t *progress) {
    progress_name(progress, "looking: faults");
    for (size_t i = 0; i < run->looked_at; i++) {
        progress_update(progress, (double)i / (double)run->looked_at);
        undo_faults_of(&recordings[i], i, run);
        for (size_t k = 0; k < fault_kind_count; k++) {
            if (fault_kinds[k]->suspect != NULL) {
                undo_suspected(fault_kinds[k], &recordings[i], i, run);
            }
        }
    }
}

/* Of readings that stand in several rows each, the first rows are what there is. Before the excerpt, which may take
 * means, and before the look, which sees the rest of what is wrong in them only. NULL: they stay. */
static held_readings_t *leave_copies_out(recording_t *recordings, size_t count) {
    held_readings_t *held = allocate(count, sizeof *held);
    for (size_t i = 0; i < count; i++) {
        held_readings_find(&recordings[i], &held[i]);
    }
    if (!held_readings_undo(recordings, count, held)) {
        free(held);
        return NULL;
    }
    return held;
}

/* The look does not see them any more. They come before its faults, which are about what is left. */
static void tell_copies(const held_readings_t *held, diagnosis_run_t *run) {
    fault_list_t *faults = &run->faults;
    for (size_t i = run->looked_at; i-- > 0;) {
        if (held_readings_add(faults, i, &held[i]) != NULL) {
            fault_t fault = faults->fault[faults->count - 1];
            fault.undone = true;
            memmove(&faults->fault[1], &faults->fault[0], (faults->count - 1) * sizeof fault);
            faults->fault[0] = fault;
        }
    }
}

/* Before the stages, which report themselves. held: what was left out, or NULL. */
static bool look_first(recording_t *recordings, size_t count, const held_readings_t *held, diagnosis_run_t *run,
                       failure_t *failure) {
    progress_t progress;
    run->looked_at = count;
    for (size_t i = 0; i < count; i++) {
        run->looked_at = recordings[i].samples < LOOK_LEAST_SAMPLES ? 0 : run->looked_at;
    }
    progress_begin(&progress, "looking");
    progress_update(&progress, 0.0);
    run->looks = looks_at(recordings, run->looked_at, failure);
    if (run->looks != NULL) {
        faults_find(run->looks, run->looked_at, &run->faults);
        run->masked = faults_mask(&run->faults, recordings);
        undo_faults(recordings, run, &progress);
        if (held != NULL) {
            tell_copies(held, run);
        }
    }
    progress_end(&progress);
    return run->looks != NULL;
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

/* The innermost rails of all recordings. */
static void see_rails(const look_t *looks, size_t count, probe_seen_t *seen) {
    double low_v = -HUGE_VAL, high_v = HUGE_VAL, outside_v[2] = {HUGE_VAL, -HUGE_VAL};
    for (size_t i = 0; i < count; i++) {
        const rails_t *rails = &looks[i].rails;
        const double *range_v = looks[i].drive.range_v;
        outside_v[0] = fmin(outside_v[0], 2.0 * range_v[0] - range_v[1]);
        outside_v[1] = fmax(outside_v[1], 2.0 * range_v[1] - range_v[0]);
        low_v = rails->low ? fmax(low_v, rails->low_v) : low_v;
        high_v = rails->high ? fmin(high_v, rails->high_v) : high_v;
    }
    seen->rails = isfinite(low_v) || isfinite(high_v);
    seen->rail_v[0] = isfinite(low_v) ? low_v : outside_v[0];
    seen->rail_v[1] = isfinite(high_v) ? high_v : outside_v[1];
}

/* What blocks begin their search with. */
static probe_seen_t seen_by(const look_t *looks, size_t count) {
    probe_seen_t seen = {0};
    double creep = 0.0, weights = 0.0;
    see_ring(looks, count, &seen);
    see_rails(looks, count, &seen);
    for (size_t i = 0; i < count; i++) {
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
    progress_t progress;
    progress_begin(&progress, "diagnosing: account");
    progress_update(&progress, 0.0);
    const bool good = account_for(&run->answer, recordings, count, &run->account, failure);
    progress_end(&progress);
    if (!good) {
        answer_free(&run->answer);
    }
    return good;
}

bool diagnosis_run(const model_t *given, recording_t *recordings, size_t count, size_t most_samples,
                   diagnosis_run_t *run, failure_t *failure) {
    *run = (diagnosis_run_t){0};
    if (most_samples != 0 && most_samples / count < DIAGNOSIS_LEAST_SAMPLES) {
        return fail(failure, "a diagnosis of %zu of the samples: it takes %d of each recording", most_samples,
                    DIAGNOSIS_LEAST_SAMPLES);
    }
    held_readings_t *held = leave_copies_out(recordings, count);
    excerpt(recordings, count, most_samples != 0 ? most_samples : (size_t)threshold.most_samples);
    const bool good =
        look_first(recordings, count, held, run, failure) && find_and_account(given, recordings, count, run, failure);
    free(held);
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
    progress_t progress;
    progress_begin(&progress, "writing the page");
    progress_update(&progress, 0.0);
    const bool good = diagnosis_write_report(&run->answer, &run->account, recordings, count,
                                             run->looked_at > 0 ? run->looks : NULL, path, failure);
    progress_end(&progress);
    return good;
}

void diagnosis_run_free(diagnosis_run_t *run) {
    account_free(&run->account);
    answer_free(&run->answer);
    look_away(run);
}
