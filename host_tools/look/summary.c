/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "look/summary.h"
#include "look/look.h"

#include <stdlib.h>
#include <string.h>

/* Of more samples than that a look would take longer than to read the file. */
enum { MOST_SAMPLES = 1 << 16 };
/* Samples a period of the highest frequency of a drive, from which on leaving out samples does not change its kind. */
static const double fine_enough = 20.0;

/* Every so many samples of all of a recording, or its first ones alone, where its drive is too fast for that. To be
 * freed. false: as summary_make. */
static bool take_part(const recording_t *recording, recording_t *part, failure_t *failure) {
    size_t stride = 1 + (recording->samples - 1) / MOST_SAMPLES, samples = 1 + (recording->samples - 1) / stride;
    if (stride > 1) {
        recording_t first = *recording; /* the columns are the caller's */
        drive_look_t drive;
        first.samples = MOST_SAMPLES;
        if (!drive_look(&first, &drive, failure)) {
            return false;
        }
        if (drive.frequency_hz[1] * fine_enough * (double)stride > recording->sample_rate_hz) {
            stride = 1;
            samples = MOST_SAMPLES;
        }
        drive_look_free(&drive);
    }
    recording_create(part, recording->name, recording->sample_rate_hz / (double)stride, samples);
    for (size_t i = 0; i < recording->keys; i++) {
        recording_set_key(part, recording->key[i].key, recording->key[i].value);
    }
    for (column_t c = COLUMN_DRIVE; c <= COLUMN_DISPLACEMENT; c++) {
        for (size_t k = 0; k < samples; k++) {
            part->column[c][k] = recording->column[c][k * stride];
        }
    }
    return true;
}

static void see_noise(const recording_t *part, const drive_look_t *drive, summary_t *summary) {
    repetition_t repetition;
    noise_look_t noise;
    repetition_look(part, drive, &repetition);
    noise_look(part, drive, &repetition, &noise);
    summary->noise_um = noise_known_um(&noise);
    summary->noise_from = noise.rest.samples > 0 ? "at rest" : "between passes";
    if (noise.rest.samples == 0 && noise.repeat.samples == 0) {
        prediction_t prediction;
        prediction_make(part, drive, &prediction);
        summary->noise_um = prediction.noise_um;
        summary->noise_from = "between neighbours";
        prediction_free(&prediction);
    }
    repetition_free(&repetition);
}

/* A period that is no whole number of samples ends up to one behind the last sample that repeats another. */
static size_t whole_periods(const drive_look_t *drive) {
    return drive->period > 0.0 ? (size_t)((double)(span_length(drive->repeat) + 1) / drive->period) : 0;
}

bool summary_make(const recording_t *recording, summary_t *summary, failure_t *failure) {
    recording_t part;
    drive_look_t drive;
    static_map_t map;
    if (recording->samples < LOOK_LEAST_SAMPLES) {
        return fail(failure, "%s: %zu samples are too few to look at; %d are needed", recording->name,
                    recording->samples, LOOK_LEAST_SAMPLES);
    }
    if (!take_part(recording, &part, failure)) {
        return false;
    }
    if (!drive_look(&part, &drive, failure)) {
        recording_free(&part);
        return false;
    }
    static_map_look(&part, &drive, &map);
    *summary = (summary_t){
        .looked_at_s = (double)part.samples / part.sample_rate_hz,
        .whole =
            part.samples == recording->samples ||
                    part.sample_rate_hz<recording->sample_rate_hz, .kind = drive.kind,
                                        .period_s = drive.period / part.sample_rate_hz,
                                        .periods = whole_periods(&drive), .line_error_percent = map.line_error_percent,
                                        .width_percent = map.levels> 0
                ? map.width_percent
                : 0.0};
    see_noise(&part, &drive, summary);
    values_range(recording->column[COLUMN_DRIVE], recording->samples, summary->range_v);
    values_range(recording->column[COLUMN_DISPLACEMENT], recording->samples, summary->stroke_um);
    drive_look_free(&drive);
    recording_free(&part);
    return true;
}

void summary_print(FILE *file, const summary_t *s) {
    const bool small = s->noise_um < 0.1;
    fprintf(file, "%-12s drive %.4g to %.4g V, %s", "it holds", s->range_v[0], s->range_v[1], drive_kind_text(s->kind));
    if (s->periods > 0) {
        fprintf(file, ", %zu periods of %.4g s (%.4g Hz)", s->periods, s->period_s, 1.0 / s->period_s);
    }
    fprintf(file, "\n%-12s stroke %.4g um, beside a straight line %.2g %%", "", s->stroke_um[1] - s->stroke_um[0],
            s->line_error_percent);
    if (s->width_percent > 0.0) {
        fprintf(file, ", loop %.2g %% wide", s->width_percent);
    }
    fprintf(file, "; noise about %.2g %s (%s)", small ? 1e3 * s->noise_um : s->noise_um, small ? "nm" : "um",
            s->noise_from);
    if (!s->whole) {
        fprintf(file, "; ranges of all, the rest of the first %.4g s", s->looked_at_s);
    }
    fprintf(file, "\n");
}

json_t *summary_to_json(const summary_t *s) {
    return json_pack("{s:s, s:[f, f], s:o, s:I, s:[f, f], s:f, s:o, s:f, s:s, s:f}", "drive_kind",
                     drive_kind_name(s->kind), "drive_range_v", s->range_v[0], s->range_v[1], "period_s",
                     s->periods > 0 ? json_real(s->period_s) : json_null(), "periods", (json_int_t)s->periods,
                     "position_range_um", s->stroke_um[0], s->stroke_um[1], "line_error_percent", s->line_error_percent,
                     "loop_width_percent", s->width_percent > 0.0 ? json_real(s->width_percent) : json_null(),
                     "noise_um", s->noise_um, "noise_from", s->noise_from, "looked_at_s", s->looked_at_s);
}
