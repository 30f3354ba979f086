/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/noise/drive_lines.h"
#include "diagnosis/noise/lines.h"
#include "diagnosis/where/drive_period.h"
#include "numerics/reversals.h"
#include <math.h>

/* A turn, in parts of the drive's range: more than noise and ripple. */
static const double turns_by = 0.05;
/* Fewer are regular by chance. */
static const size_t least_turns = 8;
/* A line is as wide that comes from a drive, in parts of one over its duration: what the drive makes may change once in
 * all of it. */
static const double line_width = 2.0;

/* Two turns of a drive that turns at regular times, whatever the levels; 0: it does not. */
static double turning_period(const double *u, size_t count) {
    reversals_t turns;
    reversals_find_by_part(u, count, turns_by, &turns);
    const size_t *at = turns.at, n = turns.count;
    double interval = n < least_turns ? 0.0 : (double)(at[n - 1] - at[0]) / (double)(n - 1);
    for (size_t i = 0; i < n && interval > 0.0; i++) {
        interval = fabs((double)(at[i] - at[0]) - (double)i * interval) > 1.0 ? 0.0 : interval;
    }
    reversals_free(&turns);
    return 2.0 * interval;
}

static bool is_harmonic(const double *drive, size_t samples, double turns_per_sample) {
    const double repeats = drive_period(drive, samples),
                 period = repeats > 0.0 ? repeats : turning_period(drive, samples);
    const double multiple = turns_per_sample * period;
    return multiple > 0.5 && fabs(multiple - round(multiple)) * (double)samples < line_width * period;
}

bool drive_has_line(const recording_t *recording, size_t from, size_t to, double hz) {
    const double *drive = recording->column[COLUMN_DRIVE] + from, sample_rate_hz = recording->sample_rate_hz;
    const size_t samples = to - from;
    double line_hz[LINES_MOST];
    const size_t lines = find_lines(drive, samples, sample_rate_hz, line_hz);
    bool has = false;
    for (size_t i = 0; i < lines; i++) {
        has = has || fabs(line_hz[i] - hz) * (double)samples < line_width * sample_rate_hz;
    }
    return has || is_harmonic(drive, samples, hz / sample_rate_hz);
}
