/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "report/report.h"
#include "base/json_input.h"
#include <gsl/gsl_math.h>
#include <gsl/gsl_statistics_double.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

static bool read_track(recording_t *recording, const char *path, failure_t *failure) {
    if (!recording_read(recording, path, failure)) {
        return false;
    }
    bool good = true;
    if (recording->column[COLUMN_REFERENCE] == NULL) {
        good = fail(failure, "%s: no column \"reference\": not the recording of a track", path);
    } else if (recording->samples < 8) {
        good = fail(failure, "%s: %zu samples are too few for a report", path, recording->samples);
    }
    if (!good) {
        recording_free(recording);
    }
    return good;
}

static error_measure_t tracking_error(const recording_t *recording) {
    return measure_error(recording->column[COLUMN_REFERENCE], recording->column[COLUMN_DISPLACEMENT],
                         recording->samples);
}

/* What a reference does, wherever in it a recording begins: its rms about its mean, and that of its rate. */
static void motion_of(const recording_t *recording, double *rms_um, double *rate_um_per_s) {
    const double *reference = recording->column[COLUMN_REFERENCE];
    double squares = 0.0;
    for (size_t k = 1; k < recording->samples; k++) {
        squares += gsl_pow_2((reference[k] - reference[k - 1]) * recording->sample_rate_hz);
    }
    *rms_um = gsl_stats_sd(reference, 1, recording->samples);
    *rate_um_per_s = sqrt(squares / (double)(recording->samples - 1));
}

/* References as far apart as this, as a part, are not the same one: a sine's rms is 1.22 times a triangle's. */
static const double same_within = 0.1;

static bool same_reference(const report_track_t *track) {
    double rms_um[2], rate_um_per_s[2];
    motion_of(&track->before, &rms_um[0], &rate_um_per_s[0]);
    motion_of(&track->after, &rms_um[1], &rate_um_per_s[1]);
    return fabs(rms_um[1] - rms_um[0]) <= same_within * rms_um[0] &&
           fabs(rate_um_per_s[1] - rate_um_per_s[0]) <= same_within * rate_um_per_s[0];
}

bool report_track_read(report_track_t *track, const char *name, const char *before, const char *after,
                       failure_t *failure) {
    *track = (report_track_t){.name = name};
    if (!read_track(&track->before, before, failure)) {
        return false;
    }
    if (!read_track(&track->after, after, failure)) {
        recording_free(&track->before);
        return false;
    }
    const double *reference = track->after.column[COLUMN_REFERENCE];
    double low = reference[0], high = reference[0];
    for (size_t k = 1; k < track->after.samples; k++) {
        low = fmin(low, reference[k]);
        high = fmax(high, reference[k]);
    }
    track->peak_to_peak_um = high - low;
    if (!(track->peak_to_peak_um > 0.0)) {
        report_track_free(track);
        return fail(failure, "%s: the reference does not move", after);
    }
    track->error_before = tracking_error(&track->before);
    track->error_after = tracking_error(&track->after);
    if (!isfinite(track->error_before.nrmse_percent)) {
        report_track_free(track);
        return fail(failure, "%s: the reference does not move", before);
    }
    if (!same_reference(track)) {
        report_track_free(track);
        return fail(failure, "%s and %s: their references are not the same motion: nothing to compare", before, after);
    }
    if (!(track->error_after.rms_um > 0.0)) {
        report_track_free(track);
        return fail(failure, "%s: the displacement is the reference itself: not the recording of a track", after);
    }
    track->remaining = error_budget(reference, track->after.column[COLUMN_DISPLACEMENT], track->after.samples,
                                    track->after.sample_rate_hz);
    return true;
}

/* A file without the key may be anything. */
static bool is_mode(const recording_t *recording, const char *mode) {
    const char *said = recording_key(recording, "mode");
    return said == NULL || strcmp(said, mode) == 0;
}

bool report_check_modes(const report_t *report, failure_t *failure) {
    const char *const due = report->diagnosis != NULL ? "compensate" : "linear";
    for (size_t i = 0; i < report->tracks; i++) {
        const report_track_t *t = &report->track[i];
        if (!is_mode(&t->before, due) || !is_mode(&t->after, "compensate")) {
            const char *before = recording_key(&t->before, "mode"), *after = recording_key(&t->after, "mode");
            return fail(failure,
                        "%s: by their headers BEFORE has mode %s and AFTER mode %s, the page is of %s and compensate",
                        t->name, before != NULL ? before : "unknown", after != NULL ? after : "unknown", due);
        }
    }
    return true;
}

void report_track_free(report_track_t *track) {
    recording_free(&track->before);
    recording_free(&track->after);
}

const report_words_t *report_words(const report_t *report) {
    static const report_words_t compensation = {
        .title = "Tracking with and without compensation",
        .no_help = "Compensation does not help everywhere.",
        .before = "linear drive",
        .after = "compensated",
        .what_they_are =
            "Before: the drive is a straight line of the reference. After: the drive comes from the inverse model."};
    static const report_words_t diagnosed = {
        .title = "Tracking before and after a diagnosis",
        .no_help = "What was found does not help everywhere.",
        .before = "first model",
        .after = "with what was found",
        .what_they_are = "Before: the drive comes from the inverse of the first model. After: from the inverse of that "
                         "model with what the diagnosis found."};
    return report->diagnosis == NULL ? &compensation : &diagnosed;
}

json_t *report_diagnosis_read(const char *path, failure_t *failure) {
    json_t *diagnosis = json_read(path, "a diagnosis", failure);
    if (diagnosis == NULL) {
        return NULL;
    }
    const char *format = json_string_value(json_object_get(diagnosis, "format"));
    if (format == NULL || strcmp(format, "hyst-diagnosis-1") != 0) {
        fail(failure, "%s: not a diagnosis by hyst diagnose --json", path);
        json_decref(diagnosis);
        return NULL;
    }
    return diagnosis;
}

double report_gain(const report_track_t *track) {
    return track->error_before.nrmse_percent / track->error_after.nrmse_percent;
}

const report_track_t *report_worst(const report_t *report) {
    const report_track_t *worst = &report->track[0];
    for (size_t i = 1; i < report->tracks; i++) {
        if (report_gain(&report->track[i]) < report_gain(worst)) {
            worst = &report->track[i];
        }
    }
    return worst;
}

void report_print(FILE *file, const report_t *report) {
    int width = 5;
    for (size_t i = 0; i < report->tracks; i++) {
        const int length = snprintf(NULL, 0, "%s", report->track[i].name);
        width = length > width ? length : width;
    }
    fprintf(file, "%-*s  %12s  %12s  %12s  %8s  %12s  %12s\n", width, "track", "peak-to-peak", "error before",
            "error after", "factor", "worst before", "worst after");
    for (size_t i = 0; i < report->tracks; i++) {
        const report_track_t *track = &report->track[i];
        fprintf(file, "%-*s  %9.2f um  %10.3f %%  %10.3f %%  %8.1f  %9.3f um  %9.3f um\n", width, track->name,
                track->peak_to_peak_um, track->error_before.nrmse_percent, track->error_after.nrmse_percent,
                report_gain(track), track->error_before.max_um, track->error_after.max_um);
    }
    fprintf(file, "(error: RMS of position - reference over the peak-to-peak reference; before: %s, after: %s)\n",
            report_words(report)->before, report_words(report)->after);
}

static json_t *track_to_json(const report_track_t *track) {
    const double percent = 100.0 / track->peak_to_peak_um;
    return json_pack("{s:s, s:f, s:f, s:f, s:f, s:f, s:{s:f, s:f, s:f, s:f, s:f}}", "name", track->name,
                     "before_nrmse_percent", track->error_before.nrmse_percent, "after_nrmse_percent",
                     track->error_after.nrmse_percent, "before_max_um", track->error_before.max_um, "after_max_um",
                     track->error_after.max_um, "peak_to_peak_um", track->peak_to_peak_um, "remaining",
                     "offset_and_gain_percent", percent * track->remaining.static_um, "delay_percent",
                     percent * track->remaining.delay_um, "delay_s", track->remaining.delay_s, "noise_percent",
                     percent * track->remaining.noise_um, "rest_percent", percent * track->remaining.rest_um);
}

json_t *report_to_json(const report_t *report) {
    json_t *tracks = json_array();
    for (size_t i = 0; i < report->tracks; i++) {
        json_array_append_new(tracks, track_to_json(&report->track[i]));
    }
    json_t *json = json_pack("{s:s, s:s, s:o}", "format", "hyst-tracking-1", "recording", report->recording->name,
                             "tracks", tracks);
    if (report->model->fit != NULL) {
        json_object_set(json, "fit", report->model->fit);
    }
    if (report->simulated != NULL) {
        json_object_set_new(json, "simulated", json_string(report->simulated));
    }
    if (report->diagnosis != NULL) {
        json_object_set_new(json, "diagnosis",
                            json_pack("{s:O*, s:O*}", "verdict", json_object_get(report->diagnosis, "verdict"),
                                      "findings", json_object_get(report->diagnosis, "findings")));
    }
    return json;
}
