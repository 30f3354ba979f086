/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "look/signal/repetition.h"
#include "numerics/between.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { ALIGNMENTS = 4 };

static void find_differences(const double *y, size_t samples, const drive_look_t *drive, repetition_t *r) {
    const double period = drive->period, spread = sqrt(1.0 + value_between_variance(period - floor(period)));
    const size_t passes = drive_periods(drive), all = (size_t)ceil((double)span_length(drive->repeat) - period);
    double *of_pass = allocate(passes, sizeof *of_pass);
    r->difference = allocate(all, sizeof *r->difference);
    r->slope = allocate(all, sizeof *r->slope);
    for (size_t i = 0; i < all; i++) {
        const size_t k = drive->repeat.from + i;
        r->difference[i] = (value_between(y, samples, fmin((double)samples - 1.0, (double)k + period)) - y[k]) / spread;
        r->slope[i] = k > 0 && k + 1 < samples ? 0.5 * (y[k + 1] - y[k - 1]) : 0.0;
    }
    r->count = all;
    r->rms_um = look_robust_deviation(r->difference, all);
    for (size_t p = 0; p + 1 < passes; p++) {
        const size_t from = (size_t)((double)p * period), to = (size_t)((double)(p + 1) * period);
        double squares = 0.0;
        for (size_t i = from; i < to && i < all; i++) {
            squares += r->difference[i] * r->difference[i];
        }
        r->worst_um = fmax(r->worst_um, sqrt(squares / (double)(to - from)));
    }
    free(of_pass);
}

/* Slope of a closed path by a straight line through five samples: noise of the path takes little part in it. */
static void slope_of(const double *path, size_t n, double *slope) {
    for (size_t k = 0; k < n; k++) {
        const double *const p = path;
        slope[k] = (2.0 * (p[(k + 2) % n] - p[(k + n - 2) % n]) + p[(k + 1) % n] - p[(k + n - 1) % n]) / 10.0;
    }
}

static void align(const double *const *value, repetition_t *r, double *left) {
    const size_t n = r->path_samples;
    double *slope = allocate(n, sizeof *slope), *ones = allocate(n, sizeof *ones);
    double *centred = allocate(n, sizeof *centred), *rest = allocate(n, sizeof *rest);
    const double mean = look_mean(r->path, n);
    slope_of(r->path, n, slope);
    for (size_t k = 0; k < n; k++) {
        slope[k] = -slope[k];
        ones[k] = 1.0;
        centred[k] = r->path[k] - mean;
    }
    const double *const columns[] = {slope, ones, centred};
    for (size_t p = 0; p < r->passes; p++) {
        pass_t *pass = &r->pass[p];
        look_regression_t fit;
        for (size_t k = 0; k < n; k++) {
            rest[k] = value[p][k] - r->path[k];
        }
        look_regress(columns, 3, rest, NULL, n, &fit);
        pass->lag = fit.coefficient[0];
        pass->offset_um = fit.coefficient[1];
        pass->gain = fit.coefficient[2];
        pass->lag_sigma = fit.sigma[0];
        pass->offset_sigma_um = fit.sigma[1];
        pass->gain_sigma = fit.sigma[2];
        for (size_t k = 0; k < n; k++) {
            left[p * n + k] =
                rest[k] - fit.coefficient[0] * slope[k] - fit.coefficient[1] - fit.coefficient[2] * centred[k];
        }
    }
    free(slope);
    free(ones);
    free(centred);
    free(rest);
}

static void find_passes(const double *y, size_t samples, const drive_look_t *drive, repetition_t *r) {
    const size_t n = r->path_samples, passes = r->passes;
    double *all = allocate(n * passes, sizeof *all), *left = allocate(n * passes, sizeof *left);
    double *across = allocate(passes, sizeof *across);
    const double **value = allocate(passes, sizeof *value);
    for (size_t p = 0; p < passes; p++) {
        const double from = (double)drive->repeat.from + (double)p * drive->period;
        value[p] = all + p * n;
        r->pass[p].at = (size_t)(from + 0.5);
        for (size_t k = 0; k < n; k++) {
            all[p * n + k] = value_between(y, samples, fmin((double)samples - 1.0, from + (double)k));
        }
    }
    for (size_t k = 0; k < n; k++) {
        for (size_t p = 0; p < passes; p++) {
            across[p] = value[p][k];
        }
        r->path[k] = look_quantile(across, passes, 0.5);
    }
    for (size_t i = 0; i < ALIGNMENTS; i++) {
        align(value, r, left);
        for (size_t k = 0; i + 1 < ALIGNMENTS && k < n; k++) {
            for (size_t p = 0; p < passes; p++) {
                across[p] = left[p * n + k];
            }
            r->path[k] += look_quantile(across, passes, 0.5);
        }
    }
    r->left_um = look_robust_deviation(left, n * passes);
    free(all);
    free(left);
    free(across);
    free(value);
}

void repetition_look(const recording_t *recording, const drive_look_t *drive, repetition_t *repetition) {
    const double *y = recording->column[COLUMN_DISPLACEMENT];
    memset(repetition, 0, sizeof *repetition);
    if (drive_periods(drive) < 2) {
        return;
    }
    find_differences(y, recording->samples, drive, repetition);
    if (drive_periods(drive) >= REPETITION_LEAST_PASSES) {
        repetition->passes = drive_periods(drive);
        repetition->path_samples = (size_t)drive->period;
        repetition->path = allocate(repetition->path_samples, sizeof *repetition->path);
        repetition->pass = allocate(repetition->passes, sizeof *repetition->pass);
        find_passes(y, recording->samples, drive, repetition);
    }
}

void repetition_free(repetition_t *repetition) {
    free(repetition->difference);
    free(repetition->slope);
    free(repetition->path);
    free(repetition->pass);
    memset(repetition, 0, sizeof *repetition);
}
