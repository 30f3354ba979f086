/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/judgement/no_physics.h"
#include "diagnosis/noise/drive_lines.h"
#include "numerics/least_squares.h"
#include "thresholds/thresholds.h"
#include <gsl/gsl_math.h>
#include <stdlib.h>
#include <string.h>

/* A rest is looked at where the line has so many periods: with fewer a parabola imitates it. */
static const double least_periods = 2.0;
/* The first part of a rest still has what the motion before it left. */
static const double settles = 0.1;

static bool too_short(const samples_t *samples, const model_block_t *block) {
    return model_lag_s(block) * samples_fastest_hz(samples) < threshold.least_lag_samples;
}

/* A mode of the mechanics that no sample can show. */
static bool too_fast(const samples_t *samples, const model_block_t *block) {
    const double most_hz = 0.5 * samples_fastest_hz(samples);
    for (size_t p = 0; block->block->place == PLACE_MECHANICS && p < block->block->parameters; p++) {
        if (strcmp(block->block->parameter[p].unit, "Hz") == 0 && block->parameter[p].value[0] > most_hz) {
            return true;
        }
    }
    return false;
}

typedef struct {
    size_t from, to;
} stretch_t;

/* The next stretch of a drive from where the last one ended: at rest, or in motion until it rests again. false: none.
 */
static bool next_stretch(const recording_t *recording, double range_v, stretch_t *stretch, bool *rests) {
    const double *u = recording->column[COLUMN_DRIVE], still = threshold.still * range_v;
    const size_t least = (size_t)ceil(threshold.least_rest_s * recording->sample_rate_hz);
    size_t since = stretch->to, k = since + 1;
    stretch->from = stretch->to;
    for (; k < recording->samples; k++) {
        if (fabs(u[k] - u[since]) > still) {
            if (k - since >= least) {
                break;
            }
            since = k;
        } else if (k - since + 1 >= least && since > stretch->from) {
            k = since; /* the motion ends where this rest began */
            break;
        }
    }
    *rests = since == stretch->from && k - since >= least;
    stretch->to = k;
    return stretch->from < recording->samples;
}

/* Amplitude of the line in a rest, beside a parabola; 0 where it is too short to say. */
static double amplitude_at_rest(const recording_t *recording, size_t from, size_t to, double hz) {
    enum { COLUMNS = 5 };
    const double turns = hz / recording->sample_rate_hz;
    const size_t start = from + (size_t)(settles * (double)(to - from)), count = to - start;
    double x[COLUMNS] = {0};
    failure_t ignored;
    if (count < 4 * COLUMNS || turns * (double)count < least_periods) {
        return 0.0;
    }
    double *columns = allocate(COLUMNS * count, sizeof *columns);
    for (size_t k = 0; k < count; k++) {
        const double t = (double)k / (double)count, angle = 2.0 * M_PI * turns * (double)k;
        columns[k] = 1.0;
        columns[count + k] = t;
        columns[2 * count + k] = t * t;
        columns[3 * count + k] = cos(angle);
        columns[4 * count + k] = sin(angle);
    }
    const bool good =
        fit_columns(columns, recording->column[COLUMN_DISPLACEMENT] + start, count, COLUMNS, NULL, x, &ignored);
    free(columns);
    return good ? hypot(x[3], x[4]) : 0.0;
}

bool no_physics(const samples_t *samples, const model_block_t *block) {
    if (too_short(samples, block) || too_fast(samples, block)) {
        return true;
    }
    if (!block->block->own_clock) {
        return false;
    }
    const double hz = block->parameter[0].value[0];
    double at_rest = 0.0;
    size_t longest = 0;
    bool of_drive = false;
    for (size_t i = 0; i < samples->count; i++) {
        const recording_t *r = &samples->recordings[i];
        stretch_t stretch = {0};
        double range[2];
        bool rests;
        values_range(r->column[COLUMN_DRIVE], r->samples, range);
        while (next_stretch(r, range[1] - range[0], &stretch, &rests)) {
            const size_t length = stretch.to - stretch.from;
            of_drive = of_drive || (!rests && drive_has_line(r, stretch.from, stretch.to, hz));
            if (rests && length > longest) {
                at_rest = amplitude_at_rest(r, stretch.from, stretch.to, hz);
                longest = at_rest > 0.0 ? length : longest;
            }
        }
    }
    return of_drive && at_rest < threshold.hum_at_rest * fabs(block->parameter[1].value[0]);
}
