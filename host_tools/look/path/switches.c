/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "look/path/switches.h"
#include "look/path/jump.h"
#include "numerics/autocorrelation.h"
#include "thresholds/thresholds.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { OFFSET, GAIN, ADDED };

/* Beside the columns, gain and offset from an instant on are two columns more, 0 before it: 1 and the path. Sums in
 * windows are all that each instant needs: products with the columns, with each other, with the readings. Returns the
 * window that leaves least, or 0. */
static size_t best_switch(const problem_t *p, const double *path, double *left) {
    const size_t m = p->columns, width = m + ADDED + 1;
    double *sums = allocate(ADDED * p->windows * width, sizeof *sums), *total = allocate(ADDED * width, sizeof *total);
    double *white = allocate(ADDED * m, sizeof *white), *y_white = allocate(m, sizeof *y_white);
    double *ones = allocate(p->n, sizeof *ones);
    const double *const other[] = {ones, path, p->y}, *const of_gain = total + width;
    const double all = problem_left(p, p->y, y_white);
    size_t best = 0;
    *left = HUGE_VAL;
    for (size_t k = 0; k < p->n; k++) {
        ones[k] = 1.0;
    }
    problem_window_products(p, other, ADDED, other, ADDED + 1, sums);
    for (size_t w = p->windows; w-- > 1;) {
        for (size_t a = 0; a < ADDED; a++) {
            for (size_t c = 0; c < width; c++) {
                total[a * width + c] += sums[(a * p->windows + w) * width + c];
            }
            memcpy(white + a * m, total + a * width, m * sizeof *white);
        }
        column_factor_whiten(&p->factor, white, ADDED, m);
        if (!problem_has_sides(p, w)) {
            continue;
        }
        const double s11 = total[m] - problem_dot(white, white, m),
                     s12 = total[m + GAIN] - problem_dot(white, white + m, m);
        const double s22 = of_gain[m + GAIN] - problem_dot(white + m, white + m, m);
        const double r1 = total[m + ADDED] - problem_dot(white, y_white, m),
                     r2 = of_gain[m + ADDED] - problem_dot(white + m, y_white, m);
        const double determinant = s11 * s22 - s12 * s12;
        const double taken = determinant > 1e-9 * s11 * s22
                                 ? (r1 * r1 * s22 - 2.0 * r1 * r2 * s12 + r2 * r2 * s11) / determinant
                                 : r1 * r1 / s11;
        if (all - taken < *left) {
            *left = all - taken;
            best = w;
        }
    }
    free(sums);
    free(total);
    free(white);
    free(y_white);
    free(ones);
    return best;
}

/* A fit of the columns with an offset, or (numbers = ADDED) an offset and a gain, from a row on. */
typedef struct {
    look_regression_t all;
    double added[ADDED], sigma[ADDED];
    double left; /* sum of squares */
} switch_fit_t;

static switch_fit_t fit_switch(const problem_t *p, const double *path, size_t row, size_t numbers, double *residual) {
    const size_t m = p->columns;
    const double *column[LOOK_MOST_COLUMNS];
    double *added = allocate(ADDED * p->n, sizeof *added);
    switch_fit_t fit;
    for (size_t k = row; k < p->n; k++) {
        added[k] = 1.0;
        added[p->n + k] = path[k];
    }
    memcpy(column, p->column, m * sizeof *column);
    column[m + OFFSET] = added;
    column[m + GAIN] = added + p->n;
    look_regress(column, m + numbers, p->y, NULL, p->n, &fit.all);
    memcpy(fit.added, fit.all.coefficient + m, sizeof fit.added);
    memcpy(fit.sigma, fit.all.sigma + m, sizeof fit.sigma);
    memcpy(residual, p->y, p->n * sizeof *residual);
    columns_add(column, m + numbers, fit.all.coefficient, -1.0, p->n, residual);
    fit.left = problem_dot(residual, residual, p->n);
    free(added);
    return fit;
}

/* What the columns alone make of the position in a fit. */
static void path_of(const problem_t *p, const switch_fit_t *fit, double *path) {
    memset(path, 0, p->n * sizeof *path);
    columns_add(p->column, p->columns, fit->all.coefficient, 1.0, p->n, path);
}

static double change_at(const switch_fit_t *fit, double position) {
    return fit->added[OFFSET] + fit->added[GAIN] * position;
}

/* The sample: where the readings stop to be better without the switch than with it. */
static size_t refine_switch(const problem_t *p, const double *path, size_t window, const switch_fit_t *fit,
                            const double *residual, size_t *within) {
    const size_t middle = p->from[window], first = p->from[window - 1];
    const size_t last = window + 1 < p->windows ? p->from[window + 1] : p->n;
    double *gains = allocate(p->n, sizeof *gains);
    for (size_t k = first; k < last; k++) {
        const double jump = change_at(fit, path[k]);
        const double with = k >= middle ? residual[k] : residual[k] - jump;
        const double without = k >= middle ? residual[k] + jump : residual[k];
        gains[k] = without * without - with * with;
    }
    const double slack = threshold.switch_within * threshold.switch_within * fit->left / (double)p->n;
    const size_t best = problem_instant(gains, first, last, slack, within);
    free(gains);
    return best;
}

/* The path holds some of the change itself. What the columns alone make of it is the position before; gain and offset
 * are to be those of that. */
static void relative_to_before(const problem_t *p, const double *path, const switch_fit_t *fit, double *gain,
                               double *offset_um) {
    double *before = allocate(p->n, sizeof *before), *ones = allocate(p->n, sizeof *ones);
    double *added = allocate(p->n, sizeof *added);
    const double *const column[] = {ones, before};
    look_regression_t line;
    path_of(p, fit, before);
    for (size_t k = 0; k < p->n; k++) {
        ones[k] = 1.0;
        added[k] = change_at(fit, path[k]);
    }
    *offset_um = fit->added[OFFSET];
    *gain = fit->added[GAIN];
    if (*gain != 0.0 && look_regress(column, 2, added, NULL, p->n, &line)) {
        *offset_um = line.coefficient[0];
        *gain = line.coefficient[1];
    }
    free(before);
    free(ones);
    free(added);
}

/* Whether the readings beside the path jump there. */
static jump_t switches_at(const problem_t *p, const double *path, size_t row, double height) {
    double *beside = allocate(p->n, sizeof *beside);
    for (size_t k = 0; k < p->n; k++) {
        beside[k] = p->y[k] - path[k];
    }
    const jump_t jump = jumps_around(p, beside, row, 0, height);
    free(beside);
    return jump;
}

/* The path that gain and offset act on. Begun with the readings themselves, as what the columns make of them without a
 * switch has some of it in it. */
static void path_before(const problem_t *p, size_t row, double *path, double *residual) {
    enum { ROUNDS = 3 };
    memcpy(path, p->y, p->n * sizeof *path);
    for (size_t round = 0; round < ROUNDS; round++) {
        const switch_fit_t fit = fit_switch(p, path, row, ADDED, residual);
        path_of(p, &fit, path);
    }
}

/* Whether an instant is where the drive begins or ceases to rest: what begins there is the actuator's. */
static bool drive_turns(const drive_look_t *drive, size_t sample, size_t within) {
    for (size_t i = 0; i < drive->rests; i++) {
        const look_span_t *rest = &drive->rest[i];
        if ((sample + within >= rest->from && sample <= rest->from + within) ||
            (sample + within >= rest->to && sample <= rest->to + within)) {
            return true;
        }
    }
    return false;
}

/* Root mean square of the drive's steps between two samples, those that are none left aside. */
static double speed(const double *drive, size_t from, size_t to) {
    double sum = 0.0;
    size_t count = 0;
    for (size_t k = from + 1; k < to; k++) {
        const double step = drive[k] - drive[k - 1];
        sum += step * step;
        count += step != 0.0 ? 1 : 0;
    }
    return count > 0 ? sqrt(sum / (double)count) : 0.0;
}

/* Whether the drive is much faster on one side of an instant, which is known to a window, than on the other: an
 * actuator has another gain there, by its losses, lags and modes. Within a period any drive is fast and slow. */
static bool drive_changes_speed(const recording_t *recording, const drive_look_t *drive, size_t sample, size_t window) {
    enum { PARTS = 16 };
    const double *drive_v = recording->column[COLUMN_DRIVE];
    const size_t part = recording->samples / PARTS, period = (size_t)ceil(drive->period);
    const size_t far = window + (period > part ? period : part);
    if (sample < far || sample + far > recording->samples) {
        return false;
    }
    const double before = speed(drive_v, sample - far, sample - window),
                 after = speed(drive_v, sample + window, sample + far);
    return fmin(before, after) * threshold.switch_other_speed < fmax(before, after);
}

/* Of a window, which a path with some of the switch in it points to, and those around it that which leaves least with
 * the path without. */
static size_t settle_switch(const problem_t *p, size_t window, double *path, double *residual) {
    double *tried = allocate(p->n, sizeof *tried), *best = allocate(p->n, sizeof *best), least = HUGE_VAL;
    const size_t first = window > 1 ? window - 1 : 1, last = window + 1;
    for (size_t w = first; w <= last && w < p->windows; w++) {
        path_before(p, p->from[w], tried, residual);
        const double left = fit_switch(p, tried, p->from[w], ADDED, residual).left;
        if (left < least) {
            least = left;
            window = w;
            memcpy(best, tried, p->n * sizeof *best);
        }
    }
    memcpy(path, best, p->n * sizeof *path);
    free(tried);
    free(best);
    return window;
}

/* One switch more, of readings of which `without` is left. false: there is none. */
static bool find_switch(problem_t *p, const recording_t *recording, const drive_look_t *drive, double *path,
                        double middle_um, double *without, double *residual, changes_t *changes) {
    enum { SETTLES = 6 };
    switch_t *change = &changes->change[changes->switches];
    double left, gain, offset_um;
    size_t window = best_switch(p, path, &left);
    if (window == 0 || !(left < (1.0 - threshold.change_explains) * *without)) {
        return false;
    }
    for (size_t round = 0, before = 0; round < SETTLES && window != before; round++) {
        before = window;
        window = settle_switch(p, window, path, residual);
    }
    switch_fit_t fit = fit_switch(p, path, p->from[window], ADDED, residual);
    const size_t at = refine_switch(p, path, window, &fit, residual, &change->within);
    const double alone = fit_switch(p, path, at, GAIN, residual).left;
    fit = fit_switch(p, path, at, ADDED, residual);
    if (!(problem_chance(p, alone, fit.left, residual, 1.0, 1.0) < p->log_chance_limit)) { /* an offset is enough */
        fit = fit_switch(p, path, at, GAIN, residual);
    }
    change->log_chance = problem_chance(p, *without, fit.left, residual, ADDED, (double)p->n);
    const bool all = fit.left < (1.0 - threshold.change_explains) * *without &&
                     problem_rms(p, fit.left) < threshold.change_at_noise * p->noise_um;
    const jump_t jump = switches_at(p, path, at, change_at(&fit, path[at < p->n ? at : at - 1]));
    if (!(change->log_chance < p->log_chance_limit) || !(jump == JUMPS || (jump == CANNOT_SAY && all)) ||
        drive_turns(drive, p->first + at, change->within + p->from[1] - p->from[0]) ||
        drive_changes_speed(recording, drive, p->first + at, p->from[1] - p->from[0])) {
        return false;
    }
    const residual_run_t run = {residual, p->n};
    const double widen = sqrt(autocorrelation_time(&run, 1));
    relative_to_before(p, path, &fit, &gain, &offset_um);
    change->at = p->first + at;
    change->gain = 1.0 + gain;
    /* The path is no better known than what is left. */
    const double of_path = gain * problem_rms(p, fit.left) / look_deviation(path, p->n);
    change->gain_sigma = hypot(fit.sigma[GAIN] * widen, of_path);
    change->offset_um = offset_um - gain * middle_um;
    change->offset_sigma_um = hypot(fit.sigma[OFFSET] * widen, change->gain_sigma * middle_um);
    for (size_t k = at; k < p->n; k++) {
        p->y[k] -= change_at(&fit, path[k]);
    }
    *without = fit.left;
    changes->left_um = problem_rms(p, fit.left);
    changes->switches++;
    return true;
}

void switches_find(problem_t *p, const recording_t *recording, const drive_look_t *drive, const double *path,
                   double middle_um, changes_t *changes) {
    double *residual = allocate(p->n, sizeof *residual), *before = allocate(p->n, sizeof *before);
    double without = problem_residual(p, residual);
    bool more = true;
    while (more && changes->switches < CHANGES_MOST) {
        memcpy(before, path, p->n * sizeof *before);
        more = find_switch(p, recording, drive, before, middle_um, &without, residual, changes);
    }
    free(residual);
    free(before);
}
