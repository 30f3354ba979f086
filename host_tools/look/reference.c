/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "look/reference.h"
#include "look/period.h"
#include "numerics/autocorrelation.h"
#include "thresholds/thresholds.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { PLAYS = 24, FINER = 4, POWERS = 3, TRENDS = 2, SHIFTINGS = 5, MOST_SHIFT = 64 };
enum { FIXED = 1 + POWERS + PLAYS + TRENDS, BY_CURVATURE = FIXED, BY_LAG, COLUMNS };

/* One play of threshold r over the drive. */
static void run_play(const double *u, size_t samples, double r, size_t finer, double *column) {
    double z = u[0];
    for (size_t k = 0; k < samples; k++) {
        for (size_t i = finer; k > 0 && i-- > 0;) {
            const double x = value_between(u, samples, (double)k - (double)i / (double)finer);
            z = fmax(x - r, fmin(x + r, z));
        }
        column[k] = z;
    }
}

static void slope_of(const double *value, size_t samples, double *slope) {
    for (size_t k = 1; k + 1 < samples; k++) {
        slope[k] = 0.5 * (value[k + 1] - value[k - 1]);
    }
    slope[0] = slope[1];
    slope[samples - 1] = slope[samples - 2];
}

/* Samples until the drive has been near both ends, as far as that does not cost too much. */
static size_t skipped(const double *u, size_t samples, const drive_look_t *drive) {
    const double near = threshold.been_at_the_end * (drive->range_v[1] - drive->range_v[0]);
    const size_t least = (size_t)(threshold.least_skipped * (double)samples);
    bool low = false, high = false;
    for (size_t k = 0; (double)k < threshold.most_skipped * (double)samples; k++) {
        low = low || u[k] < drive->range_v[0] + near;
        high = high || u[k] > drive->range_v[1] - near;
        if (low && high) {
            return k > least ? k : least;
        }
    }
    return least;
}

static void make_columns(const double *u, size_t samples, const drive_look_t *drive, long shift, double *columns) {
    const double middle = 0.5 * (drive->range_v[0] + drive->range_v[1]);
    const double half = 0.5 * (drive->range_v[1] - drive->range_v[0]);
    const size_t finer = drive->between == BETWEEN_HELD || drive->held_samples > 1 ? 1 : FINER;
    double *scaled = allocate(samples, sizeof *scaled);
    for (size_t k = 0; k < samples; k++) {
        const long from = (long)k - shift, last = (long)samples - 1;
        const double x = (u[from < 0 ? 0 : from > last ? last : from] - middle) / half;
        scaled[k] = x;
        columns[k] = 1.0;
        columns[samples + k] = x;
        columns[2 * samples + k] = x * x;
        columns[3 * samples + k] = x * x * x;
        columns[(FIXED - 2) * samples + k] = (double)k / (double)samples;
        columns[(FIXED - 1) * samples + k] = log1p(100.0 * (double)k / (double)samples);
    }
    for (size_t i = 0; i < PLAYS; i++) {
        run_play(scaled, samples, pow((double)(i + 1) / (PLAYS + 1), 1.5), finer, columns + (1 + POWERS + i) * samples);
    }
    for (size_t k = 1; k + 1 < samples; k++) {
        columns[BY_CURVATURE * samples + k] = scaled[k - 1] - 2.0 * scaled[k] + scaled[k + 1];
    }
    free(scaled);
}

/* Standard error of the lag: of the noise, and of the reference's own error. */
static double error_of_lag(const look_regression_t *fit, double tau, double noise_um, size_t rows) {
    const double sigma = fit->sigma[BY_LAG];
    if (!(sigma > 0.0)) {
        return HUGE_VAL;
    }
    const double slope = fit->rms / sigma / sqrt((double)rows); /* root mean square beside all other columns */
    /* What may hide in the scatter of the noise's own square counts, too. */
    const double chance = 1.0 - threshold.edge_of_noise * sqrt(2.0 * tau / (double)rows);
    const double misfit = sqrt(fmax(0.0, fit->rms * fit->rms - noise_um * noise_um * chance));
    return hypot(sigma * sqrt(tau), misfit / slope);
}

static void by_plays(const recording_t *recording, const drive_look_t *drive, double noise_um, reference_t *r) {
    const double *y = recording->column[COLUMN_DISPLACEMENT], *u = recording->column[COLUMN_DRIVE];
    const size_t samples = recording->samples, from = skipped(u, samples, drive);
    double *columns = allocate(COLUMNS * samples, sizeof *columns), *weight = allocate(samples, sizeof *weight);
    const double *column[COLUMNS], middle = look_mean(y, samples);
    double *centred = allocate(samples, sizeof *centred);
    look_regression_t fit = {0};
    make_columns(u, samples, drive, r->shift, columns);
    for (size_t c = 0; c < COLUMNS; c++) {
        column[c] = columns + c * samples;
    }
    for (size_t k = 0; k < samples; k++) {
        weight[k] = k >= from ? 1.0 : 0.0;
        centred[k] = y[k] - middle;
    }
    /* First without a lag, for its slope; then with; and once more without the readings that are far outside. */
    for (size_t pass = 0; pass < 3; pass++) {
        const size_t used = pass == 0 ? BY_CURVATURE : COLUMNS;
        look_regress(column, used, centred, weight, samples, &fit);
        for (size_t k = 0; k < samples; k++) {
            r->expected[k] = 0.0;
            for (size_t c = 0; c < used; c++) {
                r->expected[k] += fit.coefficient[c] * column[c][k];
            }
            r->error[k] = centred[k] - r->expected[k];
        }
        if (pass == 0) {
            slope_of(r->expected, samples, columns + BY_LAG * samples);
        } else if (pass == 1) {
            const double limit = threshold.beyond_chance * look_robust_deviation(r->error + from, samples - from);
            for (size_t k = from; k < samples; k++) {
                weight[k] = fabs(r->error[k]) <= limit ? 1.0 : 0.0;
            }
        }
    }
    const residual_run_t run = {r->error + from, samples - from};
    r->span = (look_span_t){from, samples};
    r->lag = (double)r->shift - fit.coefficient[BY_LAG];
    r->lag_sigma = error_of_lag(&fit, autocorrelation_time(&run, 1), noise_um, samples - from);
    r->left_um = r->plays_left_um = fit.rms;
    r->plays_from = from;
    memcpy(r->lag_column, columns + BY_LAG * samples, samples * sizeof *r->lag_column);
    for (size_t k = 0; k < samples; k++) {
        r->expected[k] += middle;
    }
    slope_of(r->expected, samples, r->slope);
    free(columns);
    free(weight);
    free(centred);
}

static void by_mean_path(const recording_t *recording, const drive_look_t *drive, const repetition_t *repetition,
                         reference_t *r) {
    const double *y = recording->column[COLUMN_DISPLACEMENT];
    const size_t n = repetition->path_samples;
    double *wrapped = allocate(n + 4, sizeof *wrapped);
    for (size_t k = 0; k < n + 4; k++) { /* from one sample before the path to three behind it */
        wrapped[k] = repetition->path[(k + n - 1) % n];
    }
    r->repeated = true;
    r->span.from = repetition->pass[1].at; /* the first pass has what was before it in it */
    r->span.to = (size_t)((double)drive->repeat.from + (double)repetition->passes * drive->period);
    for (size_t k = r->span.from; k < r->span.to; k++) {
        const double at = fmod((double)(k - drive->repeat.from), drive->period);
        r->expected[k] = value_between(wrapped, n + 4, at + 1.0);
        r->slope[k] = 0.5 * (value_between(wrapped, n + 4, at + 2.0) - value_between(wrapped, n + 4, at));
        r->error[k] = y[k] - r->expected[k];
    }
    r->left_um = repetition->left_um;
    free(wrapped);
}

void reference_make(const recording_t *recording, const drive_look_t *drive, const repetition_t *repetition,
                    double noise_um, reference_t *reference) {
    memset(reference, 0, sizeof *reference);
    reference->lag_sigma = HUGE_VAL;
    reference->expected = allocate(recording->samples, sizeof *reference->expected);
    reference->slope = allocate(recording->samples, sizeof *reference->slope);
    reference->error = allocate(recording->samples, sizeof *reference->error);
    reference->lag_column = allocate(recording->samples, sizeof *reference->lag_column);
    for (size_t i = 0; drive->kind != DRIVE_RESTS && i < SHIFTINGS; i++) {
        by_plays(recording, drive, noise_um, reference);
        const double beyond = reference->lag - (double)reference->shift;
        const long next = (long)fmax(-MOST_SHIFT, fmin(MOST_SHIFT, round(reference->lag)));
        if (fabs(beyond) < threshold.lag_needs_shift || fabs(beyond) < reference->lag_sigma ||
            next == reference->shift) {
            break;
        }
        reference->shift = i + 1 < SHIFTINGS ? next : reference->shift;
    }
    /* The lag against the drive is that of the plays in any case. */
    if (repetition->passes > 0 &&
        (double)span_length(drive->repeat) >
            threshold.mean_path_part * ((double)recording->samples - 0.5 * (double)drive->repeat.from)) {
        memset(reference->expected, 0, recording->samples * sizeof *reference->expected);
        memset(reference->slope, 0, recording->samples * sizeof *reference->slope);
        memset(reference->error, 0, recording->samples * sizeof *reference->error);
        by_mean_path(recording, drive, repetition, reference);
    }
}

void reference_free(reference_t *reference) {
    free(reference->expected);
    free(reference->slope);
    free(reference->error);
    free(reference->lag_column);
    memset(reference, 0, sizeof *reference);
}

size_t reference_columns_count(const reference_t *reference) {
    return COLUMNS + (reference->repeated ? 2 : 0);
}

void reference_columns(const recording_t *recording, const drive_look_t *drive, const reference_t *reference,
                       double *columns) {
    const size_t samples = recording->samples;
    make_columns(recording->column[COLUMN_DRIVE], samples, drive, reference->shift, columns);
    memcpy(columns + BY_LAG * samples, reference->lag_column, samples * sizeof *columns);
    if (reference->repeated) {
        memcpy(columns + COLUMNS * samples, reference->expected, samples * sizeof *columns);
        memcpy(columns + (COLUMNS + 1) * samples, reference->slope, samples * sizeof *columns);
    }
}
