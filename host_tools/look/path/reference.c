/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "look/path/reference.h"
#include "look/path/reference_columns.h"
#include "numerics/autocorrelation.h"
#include "numerics/between.h"
#include "numerics/column_factor.h"
#include "thresholds/thresholds.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SHIFTINGS = 5, MOST_SHIFT = 64, MEAN_PATHS = 2 };

static void slope_of(const double *value, size_t samples, double *slope) {
    for (size_t k = 1; k + 1 < samples; k++) {
        slope[k] = 0.5 * (value[k + 1] - value[k - 1]);
    }
    slope[0] = slope[1];
    slope[samples - 1] = slope[samples - 2];
}

/* Which part of the motion a sample belongs to: rising or falling, third of the speed, third of the range. */
static size_t part_of_motion(double slope, double slow, double fast, double level) {
    const size_t speed = fabs(slope) < slow ? 0 : fabs(slope) < fast ? 1 : 2;
    const size_t third = level < -1.0 / 3.0 ? 0 : level < 1.0 / 3.0 ? 1 : 2;
    return (slope > 0.0 ? 0 : 9) + 3 * speed + third;
}

/* Variance of a coefficient whose column, beside the others, is `alone`: what errors that stay together within a part
 * do to it. */
static double variance_by_parts(const double *moment, size_t parts, double square) {
    double sum = 0.0;
    size_t used = 0;
    for (size_t i = 0; i < parts; i++) {
        sum += moment[i] * moment[i];
        used += moment[i] != 0.0 ? 1 : 0;
    }
    return used > 1 ? sum * (double)used / (double)(used - 1) / (square * square) : HUGE_VAL;
}

/* Standard error of the lag: the largest of that of correlated noise, and of what the errors of whole parts of the
 * motion and of the time say. A lag is the same in all of them; what the reference cannot follow is not. */
static double error_of_lag(const double *const *column, size_t by_lag, const double *error, const double *weight,
                           size_t samples, double sigma, double tau, double *alone_um) {
    enum { TIMES = 24, MOTIONS = 18 };
    const double *slope = column[by_lag], *x = column[REFERENCE_BY_POWER - 1];
    double *alone = allocate(samples, sizeof *alone), *speed = allocate(samples, sizeof *speed);
    double of_time[TIMES] = {0.0}, of_motion[MOTIONS] = {0.0}, square = 0.0;
    look_regression_t by_others = {0};
    look_regress(column, by_lag, slope, weight, samples, &by_others);
    memcpy(alone, slope, samples * sizeof *alone);
    columns_add(column, by_lag, by_others.coefficient, -1.0, samples, alone);
    for (size_t k = 0; k < samples; k++) {
        speed[k] = fabs(slope[k]);
    }
    const double slow = look_quantile(speed, samples, 1.0 / 3.0), fast = look_quantile(speed, samples, 2.0 / 3.0);
    for (size_t k = 0; k < samples; k++) {
        const double moment = weight[k] * alone[k] * error[k];
        square += weight[k] * alone[k] * alone[k];
        of_time[k * TIMES / samples] += moment;
        of_motion[part_of_motion(slope[k], slow, fast, x[k])] += moment;
    }
    free(alone);
    free(speed);
    if (!(square > 0.0) || !(sigma > 0.0)) {
        return HUGE_VAL;
    }
    *alone_um = sqrt(square / (double)samples);
    return sqrt(fmax(sigma * sigma * tau,
                     fmax(variance_by_parts(of_time, TIMES, square), variance_by_parts(of_motion, MOTIONS, square))));
}

/* One path over and over: all of its parts have the same misfit each time, and what disagrees says little. All that
 * the fit leaves beside the noise, which the passes tell, may then be in the direction of a lag. */
static double error_of_one_path(const repetition_t *repetition, double left_um, double tau, double rows,
                                double alone_um) {
    const double chance = 1.0 - threshold.edge_of_noise * sqrt(2.0 * tau / rows);
    const double noise_um = repetition->left_um;
    return sqrt(fmax(0.0, left_um * left_um - noise_um * noise_um * chance)) / alone_um;
}

/* The columns with the lag last: `all` of them, and the place of the lag's. */
static size_t order_columns(const double *columns, size_t samples, const double *column[REFERENCE_COLUMNS]) {
    const size_t all = reference_columns_of(samples);
    size_t count = 0;
    for (size_t c = 0; c < all; c++) {
        if (c != REFERENCE_BY_LAG) {
            column[count++] = columns + c * samples;
        }
    }
    column[count] = columns + REFERENCE_BY_LAG * samples;
    return count;
}

static void by_plays(const recording_t *recording, const drive_look_t *drive, const repetition_t *repetition,
                     reference_t *r) {
    const double *y = recording->column[COLUMN_DISPLACEMENT], *u = recording->column[COLUMN_DRIVE];
    const size_t samples = recording->samples, from = (size_t)(threshold.least_skipped * (double)samples);
    const double *column[REFERENCE_COLUMNS], middle = look_mean(y, samples);
    double *weight = allocate(samples, sizeof *weight), *centred = allocate(samples, sizeof *centred);
    double *slope = r->columns + REFERENCE_BY_LAG * samples;
    look_regression_t fit = {0};
    memset(r->columns, 0, r->column_count * samples * sizeof *r->columns);
    reference_columns_fill(u, samples, drive, r->shift, r->columns);
    const size_t by_lag = order_columns(r->columns, samples, column);
    for (size_t k = 0; k < samples; k++) {
        weight[k] = k >= from ? 1.0 : 0.0;
        centred[k] = y[k] - middle;
    }
    /* First without a lag, for its slope; then with; and once more without the readings that are far outside. */
    for (size_t pass = 0; pass < 3; pass++) {
        const size_t used = pass == 0 ? by_lag : by_lag + 1;
        look_regress(column, used, centred, weight, samples, &fit);
        memset(r->expected, 0, samples * sizeof *r->expected);
        columns_add(column, used, fit.coefficient, 1.0, samples, r->expected);
        for (size_t k = 0; k < samples; k++) {
            r->error[k] = centred[k] - r->expected[k];
        }
        if (pass == 0) {
            slope_of(r->expected, samples, slope);
        } else if (pass == 1) {
            const double limit = threshold.beyond_chance * look_robust_deviation(r->error + from, samples - from);
            for (size_t k = from; k < samples; k++) {
                weight[k] = fabs(r->error[k]) <= limit ? 1.0 : 0.0;
            }
        }
    }
    const residual_run_t run = {r->error + from, samples - from};
    r->span = (look_span_t){from, samples};
    r->lag = (double)r->shift - fit.coefficient[by_lag];
    const double tau = autocorrelation_time(&run, 1);
    double alone_um = 0.0;
    r->lag_sigma = error_of_lag(column, by_lag, r->error, weight, samples, fit.sigma[by_lag], tau, &alone_um);
    if (repetition->passes > 0 && alone_um > 0.0) {
        const double rows = (double)(samples - from);
        r->lag_sigma = hypot(r->lag_sigma, error_of_one_path(repetition, fit.rms, tau, rows, alone_um));
    }
    r->left_um = r->plays_left_um = fit.rms;
    r->plays_from = from;
    for (size_t k = 0; k < samples; k++) {
        r->expected[k] += middle;
    }
    slope_of(r->expected, samples, r->slope);
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
    const double *const more[MEAN_PATHS] = {r->expected, r->slope};
    for (size_t i = 0; i < MEAN_PATHS; i++) {
        memcpy(r->columns + r->column_count++ * recording->samples, more[i], recording->samples * sizeof *r->columns);
    }
    free(wrapped);
}

/* A fit that follows part of a lag makes it too small. So the lag is where none beside the whole samples is left:
 * between two of them, by the straight line through what is left at either. */
static void settle_lag(const recording_t *recording, const drive_look_t *drive, const repetition_t *repetition,
                       reference_t *r) {
    enum { ROUNDS = 4 };
    for (size_t round = 0; round < ROUNDS; round++) {
        const double beyond = r->lag - (double)r->shift, sigma = r->lag_sigma;
        const long here = r->shift, next = here + (beyond < 0.0 ? -1 : 1);
        if (!(fabs(beyond) > threshold.lag_settled * sigma) || labs(next) > MOST_SHIFT) {
            return;
        }
        r->shift = next;
        by_plays(recording, drive, repetition, r);
        const double falls = (beyond - (r->lag - (double)next)) / (double)(next - here);
        const double root = (double)here + beyond / fmax(falls, threshold.lag_falls);
        const double root_sigma = fmax(sigma, r->lag_sigma) / fmax(falls, threshold.lag_falls);
        if (fabs(root - (double)next) <= 0.5 || fabs(root - (double)here) <= 0.5) {
            if (fabs(root - (double)next) > 0.5) {
                r->shift = here;
                by_plays(recording, drive, repetition, r);
            }
            r->lag = root;
            r->lag_sigma = root_sigma;
            return;
        }
        r->lag_sigma = root_sigma;
    }
}

void reference_make(const recording_t *recording, const drive_look_t *drive, const repetition_t *repetition,
                    reference_t *reference) {
    memset(reference, 0, sizeof *reference);
    reference->lag_sigma = HUGE_VAL;
    reference->expected = allocate(recording->samples, sizeof *reference->expected);
    reference->slope = allocate(recording->samples, sizeof *reference->slope);
    reference->error = allocate(recording->samples, sizeof *reference->error);
    reference->column_count = reference_columns_of(recording->samples);
    reference->columns =
        allocate((reference->column_count + MEAN_PATHS) * recording->samples, sizeof *reference->columns);
    for (size_t i = 0; drive->kind != DRIVE_RESTS && i < SHIFTINGS; i++) {
        by_plays(recording, drive, repetition, reference);
        const double beyond = reference->lag - (double)reference->shift;
        const long next = (long)fmax(-MOST_SHIFT, fmin(MOST_SHIFT, round(reference->lag)));
        if (fabs(beyond) < threshold.lag_needs_shift || fabs(beyond) < reference->lag_sigma ||
            next == reference->shift) {
            break;
        }
        reference->shift = i + 1 < SHIFTINGS ? next : reference->shift;
    }
    if (drive->kind != DRIVE_RESTS) {
        settle_lag(recording, drive, repetition, reference);
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

void reference_columns_free(reference_t *reference) {
    free(reference->columns);
    reference->columns = NULL;
    reference->column_count = 0;
}

void reference_free(reference_t *reference) {
    free(reference->expected);
    free(reference->slope);
    free(reference->error);
    reference_columns_free(reference);
    memset(reference, 0, sizeof *reference);
}
