/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "interface/diagnosis_run.h"
#include "base/progress.h"
#include "diagnosis/question/excerpt.h"
#include "interface/faults_undone.h"
#include "interface/noiseless.h"
#include "look/held_readings.h"
#include "look/look_json.h"
#include "look/look_text.h"
#include "report/diagnosis_json.h"
#include "report/diagnosis_print.h"
#include "report/diagnosis_report.h"
#include "thresholds/thresholds.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

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
        run->added_noise_percent = noiseless_add(recordings, run->looks, run->looked_at);
    }
    if (run->added_noise_percent > 0.0) {
        looks_free(run->looks, run->looked_at);
        run->looks = looks_at(recordings, run->looked_at, failure);
    }
    if (run->looks != NULL) {
        run->passes = allocate(count, sizeof *run->passes);
        for (size_t i = 0; i < run->looked_at; i++) {
            const drive_look_t *drive = &run->looks[i].drive;
            run->passes[i] =
                (probe_passes_t){.from = drive->repeat.from, .to = drive->repeat.to, .period = drive->period};
        }
        faults_find(run->looks, run->looked_at, &run->faults);
        run->masked = faults_mask(&run->faults, recordings);
        progress_name(&progress, "looking: faults");
        faults_undo(recordings, run->looks, run->looked_at, &run->faults, &progress);
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
        free(run->passes);
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
static probe_seen_t seen_by(const look_t *looks, size_t count, const probe_passes_t *passes) {
    probe_seen_t seen = {.passes = count > 0 ? passes : NULL};
    double creep = 0.0, weights = 0.0;
    see_ring(looks, count, &seen);
    see_rails(looks, count, &seen);
    for (size_t i = 0; i < count; i++) {
        const response_point_t *peak = response_peak(&looks[i].response);
        seen.rests = seen.rests || looks[i].noise.rest.samples > 0;
        seen.repeats = seen.repeats || looks[i].repetition.count > 0;
        seen.drive_step_v = fmax(seen.drive_step_v, looks[i].drive.step_v);
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
    probe_seen_t seen = seen_by(run->looks, run->looked_at, run->passes);
    seen.added_noise_percent = run->added_noise_percent;
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

/* How likely the readings are, beside the operator and all that was found. Readings that are left out when a fault is
 * undone count as the others do in the mean. */
static double likelihood_of_answer(const answer_t *answer, const recording_t *recordings, const recording_t *all,
                                   size_t count) {
    double here = 0.0, there = 0.0;
    for (size_t i = 0; i < count; i++) {
        here += (double)readings_that_count(&recordings[i]);
        there += (double)readings_that_count(&all[i]);
    }
    return answer->shape_after.fitted ? answer->shape_after.log_evidence * there / here : -HUGE_VAL;
}

/* Puts what was diagnosed of the others in the place of what was diagnosed of these, with all that belongs to it. */
static void exchange(recording_t *recordings, recording_t *others, size_t count, diagnosis_run_t *run,
                     diagnosis_run_t *other) {
    const answer_t answer = run->answer;
    const account_t account = run->account;
    for (size_t i = 0; i < count; i++) {
        const recording_t recording = recordings[i];
        recordings[i] = others[i];
        others[i] = recording;
    }
    run->answer = other->answer;
    run->account = other->account;
    other->answer = answer;
    other->account = account;
}

static recording_t *copies_of(const recording_t *recordings, size_t count) {
    recording_t *copies = allocate(count, sizeof *copies);
    for (size_t i = 0; i < count; i++) {
        recording_copy(&copies[i], &recordings[i], 0, recordings[i].samples);
        copies[i].whole = recordings[i].whole;
    }
    return copies;
}

static void free_copies(recording_t *copies, size_t count) {
    for (size_t i = 0; i < count; i++) {
        copies[i].whole = NULL;
        recording_free(&copies[i]);
    }
    free(copies);
}

/* Both ways to take the recordings are diagnosed. The others, of which `other` is the run, stand for them in the end
 * unless these are likelier, beside all that was found. */
static bool find_both_ways(const model_t *given, recording_t *recordings, recording_t *others, size_t count,
                           diagnosis_run_t *run, diagnosis_run_t *other, bool *others_stand, failure_t *failure) {
    if (!find_and_account(given, others, count, other, failure)) {
        account_free(&run->account);
        answer_free(&run->answer);
        return false;
    }
    const double here = likelihood_of_answer(&run->answer, recordings, others, count);
    const double there = likelihood_of_answer(&other->answer, others, others, count);
    *others_stand = !(here > there + threshold.evidence_margin);
    if (*others_stand) {
        exchange(recordings, others, count, run, other);
    }
    account_free(&other->account);
    answer_free(&other->answer);
    return true;
}

/*
 * What is only suspected may be physics that the operator has not: a mode, too, is ahead of what a hysteresis makes of
 * it. So the readings are diagnosed as they are, and with the faults undone, which have to make them likelier.
 */
static bool find_beside_suspected(const model_t *given, recording_t *recordings, size_t count, diagnosis_run_t *run,
                                  failure_t *failure) {
    recording_t *as_they_are = copies_of(recordings, count);
    faults_undo_suspected(recordings, run->looks, &run->faults);
    diagnosis_run_t other = *run;
    bool plain;
    const bool good = find_and_account(given, recordings, count, run, failure) &&
                      find_both_ways(given, recordings, as_they_are, count, run, &other, &plain, failure);
    if (good && plain) {
        faults_withdraw_suspected(&run->faults);
    }
    free_copies(as_they_are, count);
    return good;
}

/* Where the drive jumps, and the header says nothing of it. */
static bool looks_held(const look_t *look, const recording_t *recording) {
    const bool mean = recording->whole != NULL && recording->whole->sample_rate_hz != recording->sample_rate_hz;
    return look->drive.between == BETWEEN_HELD && !look->drive.between_given && !mean;
}

/* A lag of less than a sample may be what the drive does between two; and so may a filter that is more than a lag. */
static bool found_short_lag(const answer_t *answer, double sample_rate_hz) {
    bool found = false;
    for (size_t i = 0; i < answer->findings; i++) {
        const block_t *block = answer->finding[i].block;
        const model_block_t *in_model = model_find(&answer->model, block->name);
        found = found || (in_model != NULL && block->probe != NULL && strcmp(block->probe->group, "lag") == 0 &&
                          (block->lag == LAG_NONE || model_lag_s(in_model) * sample_rate_hz < 1.0));
    }
    return found;
}

/*
 * A drive that jumps from sample to sample may be held between them, or be a line whose jumps came at any time since
 * the last sample: readings alone decide it, beside all that was found. It is looked at only where it makes a
 * difference.
 */
static bool find_beside_held(const model_t *given, recording_t *recordings, size_t count, diagnosis_run_t *run,
                             failure_t *failure) {
    bool any = false, line;
    const bool found = faults_some_suspected(&run->faults)
                           ? find_beside_suspected(given, recordings, count, run, failure)
                           : find_and_account(given, recordings, count, run, failure);
    if (!found) {
        return false;
    }
    for (size_t i = 0; i < run->looked_at; i++) {
        any = any || looks_held(&run->looks[i], &recordings[i]);
    }
    const verdict_t verdict = run->answer.verdict;
    if (!any || (verdict != PARTLY_EXPLAINED && verdict != UNKNOWN_PHYSICS &&
                 !found_short_lag(&run->answer, recordings_fastest_hz(recordings, count)))) {
        return true;
    }
    recording_t *held = copies_of(recordings, count);
    for (size_t i = 0; i < count; i++) {
        held[i].held = looks_held(&run->looks[i], &recordings[i]) || recordings[i].held;
    }
    diagnosis_run_t other = *run;
    const bool good = find_both_ways(given, recordings, held, count, run, &other, &line, failure);
    free_copies(held, count);
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
        look_first(recordings, count, held, run, failure) && find_beside_held(given, recordings, count, run, failure);
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
