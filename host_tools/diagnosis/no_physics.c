/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/no_physics.h"
#include "diagnosis/where/drive_period.h"
#include "numerics/least_squares.h"
#include "thresholds/thresholds.h"
#include <gsl/gsl_math.h>
#include <stdlib.h>

/* A rest is looked at where the line has so many periods, and shows it with so much of its amplitude. */
static const double least_periods = 2.0, shows = 0.5;
/* The first part of a rest still has what the motion before it left. */
static const double settles = 0.1;

static bool too_short(const samples_t *samples, const model_block_t *block) {
    const double number = block->parameter[0].value[0], rate_hz = samples->recordings[0].sample_rate_hz;
    const double lag_s = block->block->lag == LAG_DELAY      ? number
                         : block->block->lag == LAG_LOW_PASS ? 1.0 / (2.0 * M_PI * number)
                                                             : HUGE_VAL;
    return lag_s * rate_hz < threshold.least_lag_samples;
}

/* Whether the frequency is a multiple of the drive's, as well as the recording tells frequencies apart. */
static bool is_harmonic(const recording_t *recording, size_t from, double hz) {
    const size_t count = recording->samples - from;
    const double period = drive_period(recording->column[COLUMN_DRIVE] + from, count);
    const double multiple = hz * period / recording->sample_rate_hz;
    return period > 0.0 && multiple > 0.5 && fabs(multiple - round(multiple)) * (double)count < period;
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

/* The line's amplitude in the longest rest of all recordings; 0: none is long enough. */
static double at_rest(const samples_t *samples, double hz) {
    double amplitude = 0.0;
    size_t longest = 0;
    for (size_t i = 0; i < samples->count; i++) {
        const recording_t *r = &samples->recordings[i];
        const double *u = r->column[COLUMN_DRIVE];
        double range[2];
        values_range(u, r->samples, range);
        for (size_t k = 1, since = 0; k <= r->samples; k++) {
            if (k == r->samples || fabs(u[k] - u[since]) > threshold.still * (range[1] - range[0])) {
                const double here = k - since > longest ? amplitude_at_rest(r, since, k, hz) : 0.0;
                if (here > 0.0) {
                    amplitude = here;
                    longest = k - since;
                }
                since = k;
            }
        }
    }
    return amplitude;
}

bool no_physics(const samples_t *samples, const model_block_t *block) {
    if (too_short(samples, block)) {
        return true;
    }
    if (!block->block->own_clock) {
        return false;
    }
    const double hz = block->parameter[0].value[0], amplitude = fabs(block->parameter[1].value[0]);
    for (size_t i = 0; i < samples->count; i++) {
        if (is_harmonic(&samples->recordings[i], samples->from[i], hz)) {
            return at_rest(samples, hz) < shows * amplitude;
        }
    }
    return false;
}
