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
    PASSES = 3,
    MOST_ANSWER = REACH
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

/* What past values and some of the other column leave of a column. at: of it; own and other: how many values of it and
 * of the other column before `at` count, the latter from sample other_at on backwards. */
typedef struct {
    const double *value, *other;
    size_t at, own, other_at;
} novelty_t;

static double *new_in(const novelty_t *n, size_t samples, const unsigned char *quiet) {
    enum { MOST = 1 + REACH + MOST_ANSWER + REACH };
    const size_t rows = samples - 2 * REACH, columns = 1 + n->own + REACH;
    const double *column[MOST];
    double *all = allocate(columns * rows, sizeof *all), *weight = allocate(rows, sizeof *weight);
    double *left = allocate(rows, sizeof *left);
    look_regression_t fit = {0};
    for (size_t c = 0; c < columns; c++) {
        column[c] = all + c * rows;
        for (size_t k = 0; k < rows; k++) {
            all[c * rows + k] = c == 0        ? 1.0
                                : c <= n->own ? n->value[k + n->at - c]
                                              : n->other[k + n->other_at - (c - 1 - n->own)];
        }
    }
    for (size_t k = 0; k < rows; k++) {
        weight[k] = quiet[k + REACH];
        left[k] = n->value[k + n->at];
    }
    for (size_t pass = 0; pass < PASSES; pass++) {
        look_regress(column, columns, n->value + n->at, weight, rows, &fit);
        memcpy(left, n->value + n->at, rows * sizeof *left);
        columns_add(column, columns, fit.coefficient, -1.0, rows, left);
        const double usual = look_robust_deviation(left, rows);
        for (size_t k = 0; k < rows; k++) {
            weight[k] = quiet[k + REACH] != 0 && fabs(left[k]) <= threshold.left_out_beyond * usual;
        }
    }
    for (size_t k = 0; k < rows; k++) { /* what is far out is no noise */
        left[k] *= weight[k];
    }
    free(all);
    free(weight);
    return left;
}

/* Correlation where both are quiet. */
static double correlation_of(const double *a, const double *b, const unsigned char *quiet, size_t count) {
    double ab = 0.0, aa = 0.0, bb = 0.0;
    for (size_t k = 0; k < count; k++) {
        if (quiet[k] != 0) {
            ab += a[k] * b[k];
            aa += a[k] * a[k];
            bb += b[k] * b[k];
        }
    }
    return aa > 0.0 && bb > 0.0 ? ab / sqrt(aa * bb) : 0.0;
}

/* Whether the drive answers the readings, against their motion, at once or up to MOST_ANSWER samples later. Then it
 * knows their noise, and a reading that is predicted from the drive behind it seems to have none. */
static bool is_fed_back(const double *u, const double *y, const prediction_t *p) {
    const size_t rows = p->samples - 2 * REACH;
    const double mean_u = look_mean(u, p->samples), mean_y = look_mean(y, p->samples);
    double along = 0.0, most = 0.0;
    for (size_t k = 0; k < p->samples; k++) {
        along += (u[k] - mean_u) * (y[k] - mean_y);
    }
    for (size_t later = 0; later <= MOST_ANSWER; later++) {
        const novelty_t reading = {y, u, REACH, REACH, later > 0 ? REACH : REACH - 1};
        const novelty_t answer = {u, y, REACH + later, REACH + later, REACH - 1};
        double *in_reading = new_in(&reading, p->samples, p->quiet), *in_drive = new_in(&answer, p->samples, p->quiet);
        const double here = correlation_of(in_reading, in_drive, p->quiet + REACH, rows);
        most = fmax(most, along > 0.0 ? -here : here);
        free(in_reading);
        free(in_drive);
    }
    return most > threshold.feedback;
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
    p->fed_back = is_fed_back(u, centred, p);
    const size_t columns_used = p->fed_back ? 1 + NEIGHBOURS : COLUMNS;
    for (size_t pass = 0; pass < PASSES; pass++) {
        look_regress(column, columns_used, centred + REACH, weight, inner, &fit);
        memcpy(p->error + REACH, centred + REACH, inner * sizeof *p->error);
        columns_add(column, columns_used, fit.coefficient, -1.0, inner, p->error + REACH);
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
