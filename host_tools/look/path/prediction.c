/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "look/path/prediction.h"
#include "look/signal/resolution.h"
#include "numerics/column_factor.h"
#include "thresholds/thresholds.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    REACH = PREDICTION_REACH,
    NEIGHBOURS = 2 * REACH,
    DRIVES = 2 * REACH + 1,
    COLUMNS = 1 + NEIGHBOURS + DRIVES,
    PASSES = 3
};
static const double rounding = 0.29; /* deviation of rounding to a step, 1 / sqrt(12) */

/* Column c at sample k. */
static double entry(const double *u, const double *y, size_t c, size_t k) {
    if (c == 0) {
        return 1.0;
    }
    if (c <= NEIGHBOURS) {
        const size_t j = (c - 1) / 2 + 1;
        return (c - 1) % 2 == 0 ? y[k - j] : y[k + j];
    }
    return u[k + (c - 1 - NEIGHBOURS) - REACH];
}

static void mark_quiet(const recording_t *recording, const drive_look_t *drive, prediction_t *p) {
    const size_t after = (size_t)fmax(threshold.after_step_samples, threshold.after_step_s * recording->sample_rate_hz);
    memset(p->quiet, 1, p->samples);
    for (size_t i = 0; i < drive->steps; i++) {
        const size_t at = drive->step[i], from = at > 2 * REACH ? at - 2 * REACH : 0;
        const size_t next = i + 1 < drive->steps ? drive->step[i + 1] : p->samples;
        /* Half of the time to the next step at most, or steps that follow each other closely would leave nothing. */
        const size_t to = at + after < at + (next - at) / 2 ? at + after : at + (next - at) / 2;
        memset(p->quiet + from, 0, (to < p->samples ? to : p->samples) - from);
    }
    for (size_t k = 0; k < REACH && k < p->samples; k++) {
        p->quiet[k] = p->quiet[p->samples - 1 - k] = 0;
    }
}

static double scale_of(const prediction_t *p) {
    double *picked = allocate(p->samples, sizeof *picked), scale = 0.0;
    size_t count = 0;
    for (size_t k = 0; k < p->samples; k++) {
        if (p->quiet[k] != 0) {
            picked[count++] = p->error[k];
        }
    }
    if (count > 0) {
        scale = look_robust_deviation(picked, count);
    }
    free(picked);
    return scale;
}

void prediction_make(const recording_t *recording, const drive_look_t *drive, prediction_t *p) {
    const double *y = recording->column[COLUMN_DISPLACEMENT];
    const size_t n = recording->samples, inner = n - 2 * REACH;
    const double digit = resolution_digit(y, n), range_v = drive->range_v[1] - drive->range_v[0];
    double *u = allocate(n, sizeof *u), *columns = allocate(COLUMNS * inner, sizeof *columns);
    double *centred = allocate(n, sizeof *centred), *weight = allocate(inner, sizeof *weight);
    const double *column[COLUMNS], middle = look_quantile(y, n, 0.5);
    look_regression_t fit = {0};
    memset(p, 0, sizeof *p);
    p->samples = n;
    p->error = allocate(n, sizeof *p->error);
    p->quiet = allocate(n, 1);
    mark_quiet(recording, drive, p);
    for (size_t k = 0; k < n; k++) {
        u[k] = range_v > 0.0 ? (recording->column[COLUMN_DRIVE][k] - drive->range_v[0]) / range_v - 0.5 : 0.0;
        centred[k] = y[k] - middle;
    }
    for (size_t c = 0; c < COLUMNS; c++) {
        column[c] = columns + c * inner;
        for (size_t k = 0; k < inner; k++) {
            columns[c * inner + k] = entry(u, centred, c, k + REACH);
        }
    }
    for (size_t k = 0; k < inner; k++) {
        weight[k] = p->quiet[k + REACH];
    }
    for (size_t pass = 0; pass < PASSES; pass++) {
        look_regress(column, COLUMNS, centred + REACH, weight, inner, &fit);
        memcpy(p->error + REACH, centred + REACH, inner * sizeof *p->error);
        columns_add(column, COLUMNS, fit.coefficient, -1.0, inner, p->error + REACH);
        p->sigma_um = fmax(scale_of(p), rounding * digit);
        for (size_t k = 0; k < inner; k++) {
            /* A bad reading spoils the rows that lean on it, too: they are as far out, or next to one that is. */
            weight[k] =
                p->quiet[k + REACH] != 0 && fabs(p->error[k + REACH]) <= threshold.left_out_beyond * p->sigma_um;
        }
    }
    double leverage = 1.0;
    for (size_t j = 0; j < REACH; j++) {
        const double before = fit.coefficient[1 + 2 * j], behind = fit.coefficient[2 + 2 * j];
        p->echo[j] = 0.5 * (before + behind);
        leverage += before * before + behind * behind;
    }
    p->noise_um = p->sigma_um / sqrt(leverage);
    free(u);
    free(columns);
    free(centred);
    free(weight);
}

void prediction_free(prediction_t *prediction) {
    free(prediction->error);
    free(prediction->quiet);
    memset(prediction, 0, sizeof *prediction);
}
