/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "look/path/changes.h"
#include "look/path/changes_problem.h"
#include "look/path/clocks.h"
#include "numerics/autocorrelation.h"
#include "thresholds/thresholds.h"
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum {
    MOST_WINDOWS = 768,
    LEAST_WINDOW = 8,
    EDGE = 4 * CHANGES_MOST_SHIFT,
    ADDED = 2,
    DRIFTS = 2,
    SHIFTS = 2 * CHANGES_MOST_SHIFT
};

typedef enum { JUMPS, DOES_NOT_JUMP, CANNOT_SAY } jump_t;

/* Whether a series jumps by so much in front of a row. */
static jump_t jumps_by(const problem_t *p, const double *series, size_t row, double expected) {
    static const size_t reaches[] = {6, 12, 25, 50, 100, 200};
    for (size_t i = 0; i < sizeof reaches / sizeof reaches[0]; i++) {
        const size_t reach = reaches[i], count = 2 * reach;
        double columns[4][400], *const step = columns[2], *const bend = columns[3];
        const double *const column[] = {columns[0], columns[1], step, bend};
        look_regression_t fit;
        if (row < reach || row + reach > p->n) {
            return CANNOT_SAY;
        }
        for (size_t k = 0; k < count; k++) {
            const double x = (double)k - (double)reach + 0.5;
            if (p->prediction->quiet[p->first + row + k - reach] == 0) {
                return CANNOT_SAY;
            }
            columns[0][k] = 1.0;
            columns[1][k] = x;
            step[k] = k >= reach ? 1.0 : 0.0;
            bend[k] = k >= reach ? x : 0.0;
        }
        look_regress(column, 4, series + row - reach, NULL, count, &fit);
        const double sigma = fmax(fit.sigma[2], 1e-12 * fabs(expected));
        if (fabs(expected) >= threshold.jump_shows * sigma) {
            return fabs(fit.coefficient[2] - expected) <
                           threshold.edge_of_noise * sigma + threshold.jump_agrees * fabs(expected)
                       ? JUMPS
                       : DOES_NOT_JUMP;
        }
    }
    return CANNOT_SAY;
}

/* The same anywhere where the instant may be. */
static jump_t jumps_around(const problem_t *p, const double *series, size_t row, size_t within, double expected) {
    enum { PLACES = 8 };
    jump_t jump = jumps_by(p, series, row, expected);
    for (size_t i = 0; i <= PLACES && within > 0 && jump == DOES_NOT_JUMP; i++) {
        const size_t place = row + 2 * within * i / PLACES;
        jump = place >= within && jumps_by(p, series, place - within, expected) == JUMPS ? JUMPS : jump;
    }
    return jump;
}

typedef struct {
    size_t window;
    int samples;
    double left;
} trial_t;

static int by_left(const void *a, const void *b) {
    const double x = ((const trial_t *)a)->left, y = ((const trial_t *)b)->left;
    return x < y ? -1 : x > y ? 1 : 0;
}

/* The best instant of each shift on the grid, the best first. */
static void best_shifts(const problem_t *p, trial_t best[SHIFTS]) {
    const size_t m = p->columns, width = m + 1;
    double *before = allocate(p->windows * width, sizeof *before),
           *behind = allocate(p->windows * width, sizeof *behind);
    double *sum = allocate(width, sizeof *sum), *white = allocate(m, sizeof *white);
    size_t found = 0;
    problem_window_products(p, p->y, before);
    for (int d = -CHANGES_MOST_SHIFT; d <= CHANGES_MOST_SHIFT; d++) {
        if (d == 0) {
            continue;
        }
        best[found] = (trial_t){0, d, HUGE_VAL};
        problem_window_products(p, p->y - d, behind);
        memset(sum, 0, width * sizeof *sum);
        for (size_t w = 0; w < p->windows; w++) {
            for (size_t c = 0; c < width; c++) {
                sum[c] += behind[w * width + c];
            }
        }
        for (size_t w = 0; w + 1 < p->windows; w++) {
            for (size_t c = 0; c < width; c++) {
                sum[c] += before[w * width + c] - behind[w * width + c];
            }
            if ((double)(w + 1) < threshold.least_side * (double)p->windows ||
                (double)(p->windows - w - 1) < threshold.least_side * (double)p->windows) {
                continue;
            }
            problem_whiten(p, sum, white);
            const double left = sum[m] - problem_dot(white, white, m);
            if (left < best[found].left) {
                best[found] = (trial_t){w + 1, d, left};
            }
        }
        found++;
    }
    free(before);
    free(behind);
    free(sum);
    free(white);
    qsort(best, SHIFTS, sizeof *best, by_left);
}

/* Moves all readings from a row on. What would come from behind the last reading is that reading. */
static void apply_shift(problem_t *p, size_t row, int samples) {
    double *moved = allocate(p->n + (size_t)EDGE, sizeof *moved);
    const size_t count = p->n + EDGE - row;
    const long last = (long)(p->n + EDGE) - 1;
    for (size_t k = 0; k < count; k++) {
        const long from = (long)(row + k) - samples;
        moved[k] = p->y[from < last ? from : last];
    }
    memcpy(p->y + row, moved, count * sizeof *moved);
    free(moved);
}

/* The sample, from what readings of either kind leave beside the fit around the instant. */
static size_t refine_shift(const problem_t *p, const trial_t *trial, const double *y_before, const double *residual,
                           size_t *within) {
    enum { AROUND = 4 }; /* windows: where the motion turns, noise decides which of them is best */
    const size_t first = p->from[trial->window > AROUND ? trial->window - AROUND : 1],
                 last = trial->window + AROUND < p->windows ? p->from[trial->window + AROUND] : p->n - EDGE;
    double sum = 0.0, least = 0.0;
    size_t best = first, from, to;
    const residual_run_t run = {residual, p->n};
    /* What the reference cannot follow stays for a while: so many samples count as one. */
    const double unit = problem_dot(residual, residual, p->n) / (double)p->n * autocorrelation_time(&run, 1);
    /* residual is that of readings which are shifted from the window on; fit = right reading - residual. */
    for (size_t k = first; k < last; k++) {
        const double fit = p->y[k] - residual[k];
        const double unshifted = y_before[k] - fit, shifted = y_before[(long)k - trial->samples] - fit;
        sum += unshifted * unshifted - shifted * shifted;
        if (sum < least) {
            least = sum;
            best = k + 1;
        }
    }
    sum = 0.0;
    from = to = best;
    for (size_t k = first; k < last; k++) { /* where it could be as well, to within so many deviations */
        const double fit = p->y[k] - residual[k];
        const double unshifted = y_before[k] - fit, shifted = y_before[(long)k - trial->samples] - fit;
        sum += unshifted * unshifted - shifted * shifted;
        if (sum < least + threshold.deviations * threshold.deviations * unit) {
            from = k + 1 < from ? k + 1 : from;
            to = k + 1 > to ? k + 1 : to;
        }
    }
    *within = best - from > to - best ? best - from : to - best;
    return best;
}

/* Sets the readings right for all shifts but one (`but` = shifts: for all), from the last to the first, so that each is
 * applied where its reading was. */
static void set_right(problem_t *p, const double *original, const changes_t *changes, size_t but) {
    size_t below = SIZE_MAX;
    memcpy(p->y - EDGE, original, (p->n + 2 * EDGE) * sizeof *original);
    for (size_t left = changes->shifts; left > 0; left--) {
        size_t last = changes->shifts;
        for (size_t s = 0; s < changes->shifts; s++) {
            const bool next = changes->shift[s].at < below &&
                              (last == changes->shifts || changes->shift[s].at > changes->shift[last].at);
            last = next ? s : last;
        }
        if (last == changes->shifts) {
            break;
        }
        below = changes->shift[last].at;
        if (last != but) {
            apply_shift(p, below, changes->shift[last].samples);
        }
    }
}

/* Row of a shift, with the readings before it set right; and the other way round. */
static size_t row_of(const changes_t *changes, size_t which) {
    long row = (long)changes->shift[which].at;
    for (size_t s = 0; s < changes->shifts; s++) {
        row += changes->shift[s].at < changes->shift[which].at ? changes->shift[s].samples : 0;
    }
    return (size_t)(row > 0 ? row : 0);
}

static size_t reading_at(const changes_t *changes, size_t row) {
    long reading = (long)row;
    for (size_t s = 0; s < changes->shifts; s++) {
        reading -= row_of(changes, s) <= row ? changes->shift[s].samples : 0;
    }
    return (size_t)(reading > 0 ? reading : 0);
}

/* Tries one shift more. false, and all is as before: it does not hold. */
static bool try_shift(problem_t *p, const trial_t *trial, double without, double log_chance_limit,
                      const double *original, double *kept, double *residual, changes_t *changes, double *with) {
    shift_t *shift = &changes->shift[changes->shifts];
    memcpy(kept, p->y - EDGE, (p->n + 2 * EDGE) * sizeof *kept);
    apply_shift(p, p->from[trial->window], trial->samples);
    problem_residual(p, residual);
    size_t row = refine_shift(p, trial, kept + EDGE, residual, &shift->within);
    memcpy(p->y - EDGE, kept, (p->n + 2 * EDGE) * sizeof *kept);
    apply_shift(p, row, trial->samples); /* from the window on some readings were not right: once more */
    problem_residual(p, residual);
    row = refine_shift(p, trial, kept + EDGE, residual, &shift->within);
    const size_t moved = (size_t)abs(trial->samples); /* what was lost, or is there twice, belongs to either side */
    shift->within = shift->within > moved ? shift->within : moved;
    shift->at = reading_at(changes, row);
    shift->samples = trial->samples;
    changes->shifts++;
    set_right(p, original, changes, changes->shifts);
    *with = problem_residual(p, residual);
    shift->log_chance = problem_chance(without, *with, residual, p->n, 1.0, (double)p->n * SHIFTS);
    if (shift->log_chance < log_chance_limit && *with < threshold.shift_leaves * without) {
        return true;
    }
    changes->shifts--;
    memcpy(p->y - EDGE, kept, (p->n + 2 * EDGE) * sizeof *kept);
    return false;
}

/* Whether a shift holds beside all others: what the readings do at its instant, and what it explains of `first`, which
 * was left before any. */
static bool holds(problem_t *p, const double *original, double first, double with, double log_chance_limit,
                  const double *residual, const double *right, changes_t *changes, size_t which) {
    shift_t *shift = &changes->shift[which];
    const size_t at = row_of(changes, which);
    double *beside = allocate(p->n, sizeof *beside); /* readings without it, beside what the columns make of them */
    const double slope = at > 3 && at + 3 < p->n ? (right[at + 3] - right[at - 3]) / 6.0 : 0.0;
    set_right(p, original, changes, which);
    for (size_t k = 0; k < p->n; k++) {
        beside[k] = p->y[k] - (right[k] - residual[k]);
    }
    const jump_t jump = jumps_around(p, beside, at, shift->within, slope * (double)shift->samples);
    const double without = problem_residual(p, beside);
    free(beside);
    const bool explains = with < (1.0 - threshold.change_explains) * first;
    const bool near = explains && sqrt(with / (double)p->n) < threshold.shift_near_noise * p->noise_um;
    const bool all = explains && sqrt(with / (double)p->n) < threshold.change_at_noise * p->noise_um;
    shift->log_chance = problem_chance(without, with, residual, p->n, 1.0, (double)p->n * SHIFTS);
    return shift->log_chance < log_chance_limit && (jump == JUMPS || (jump == CANNOT_SAY && near) || all);
}

/* Two shifts at one place, as far as that is known, are one. */
static void merge_shifts(const problem_t *p, changes_t *changes) {
    const size_t window = p->from[1] - p->from[0];
    for (size_t i = 0; i < changes->shifts; i++) {
        for (size_t j = i + 1; j < changes->shifts; j++) {
            shift_t *a = &changes->shift[i], *b = &changes->shift[j];
            const size_t apart = a->at > b->at ? a->at - b->at : b->at - a->at;
            if ((double)apart <= (double)(a->within + b->within) + threshold.one_instant * (double)window) {
                const shift_t larger = abs(a->samples) >= abs(b->samples) ? *a : *b;
                const int samples = a->samples + b->samples;
                *a = larger;
                a->samples = samples;
                a->within = apart > larger.within ? apart : larger.within;
                *b = changes->shift[--changes->shifts];
                j = i;
            }
        }
    }
    for (size_t i = 0; i < changes->shifts;) {
        if (changes->shift[i].samples == 0) {
            changes->shift[i] = changes->shift[--changes->shifts];
        } else {
            i++;
        }
    }
}

/* A lag that was there all the time is no change: the readings are shifted as a whole as long as that leaves less. */
static double take_lag_out(problem_t *p, double without, double *residual, long *lag) {
    enum { MOST_ROUNDS = 3 };
    double *products = allocate(p->columns, sizeof *products), *white = allocate(p->columns, sizeof *white);
    for (size_t round = 0; round < MOST_ROUNDS; round++) {
        int best = 0;
        double least = threshold.shift_leaves * without;
        for (int d = -CHANGES_MOST_SHIFT; d <= CHANGES_MOST_SHIFT; d++) {
            const double *y = p->y - d;
            for (size_t c = 0; c < p->columns; c++) {
                products[c] = problem_dot(p->column[c], y, p->n);
            }
            problem_whiten(p, products, white);
            const double left = problem_dot(y, y, p->n) - problem_dot(white, white, p->columns);
            if (left < least) {
                least = left;
                best = d;
            }
        }
        if (best == 0) {
            break;
        }
        apply_shift(p, 0, best);
        *lag += best;
        without = problem_residual(p, residual);
    }
    free(products);
    free(white);
    return without;
}

/* Takes off what does not hold beside the others, one after the other. Returns what is left then. */
static double prune_shifts(problem_t *p, const double *original, double first, double log_chance_limit,
                           double *residual, changes_t *changes) {
    double *right = allocate(p->n, sizeof *right), with = 0.0;
    for (bool again = true; again;) {
        size_t worst = changes->shifts;
        again = false;
        set_right(p, original, changes, changes->shifts);
        memcpy(right, p->y, p->n * sizeof *right);
        with = problem_residual(p, residual);
        for (size_t s = 0; s < changes->shifts; s++) {
            if (!holds(p, original, first, with, log_chance_limit, residual, right, changes, s) &&
                (worst == changes->shifts || changes->shift[s].log_chance > changes->shift[worst].log_chance)) {
                worst = s;
            }
        }
        if (worst < changes->shifts) {
            changes->shift[worst] = changes->shift[--changes->shifts];
            again = true;
        }
    }
    set_right(p, original, changes, changes->shifts);
    free(right);
    return with;
}

/* With a shift set right the readings as a whole may stand better elsewhere. Returns what is left then. */
static double take_rest_out(problem_t *p, double *original, double without, double *residual, changes_t *changes,
                            long *lag) {
    long more = 0;
    const double left = take_lag_out(p, without, residual, &more);
    if (more == 0) {
        return left;
    }
    memcpy(p->y - EDGE, original, (p->n + 2 * EDGE) * sizeof *original);
    apply_shift(p, 0, (int)more);
    memcpy(original, p->y - EDGE, (p->n + 2 * EDGE) * sizeof *original);
    for (size_t s = 0; s < changes->shifts; s++) {
        changes->shift[s].at = (size_t)fmax(0.0, (double)((long)changes->shift[s].at + more));
    }
    *lag += more;
    set_right(p, original, changes, changes->shifts);
    return problem_residual(p, residual);
}

/* As long as one more explains something; only then, with all of them, whether each of them holds. */
static void find_shifts(problem_t *p, double log_chance_limit, changes_t *changes) {
    double *residual = allocate(p->n, sizeof *residual), *kept = allocate(p->n + 2 * EDGE, sizeof *kept);
    double *original = allocate(p->n + 2 * EDGE, sizeof *original);
    double *as_read = allocate(p->n + 2 * EDGE, sizeof *as_read);
    long lag = 0;
    memcpy(as_read, p->y - EDGE, (p->n + 2 * EDGE) * sizeof *as_read);
    const double all = problem_residual(p, residual), first = take_lag_out(p, all, residual, &lag);
    double without = first;
    bool more = true;
    memcpy(original, p->y - EDGE, (p->n + 2 * EDGE) * sizeof *original);
    changes->before_um = changes->left_um = sqrt(first / (double)p->n);
    while (more && changes->shifts < CHANGES_MOST) {
        trial_t trial[SHIFTS];
        more = false;
        best_shifts(p, trial);
        for (size_t i = 0; i < SHIFTS && trial[i].left < threshold.shift_leaves * without && !more; i++) {
            double with;
            if (try_shift(p, &trial[i], without, log_chance_limit, original, kept, residual, changes, &with)) {
                without = take_rest_out(p, original, with, residual, changes, &lag);
                more = true;
            }
        }
    }
    if (changes->shifts > 0 && !more) {
        without = prune_shifts(p, original, first, log_chance_limit, residual, changes);
    }
    /* A search that does not end explains nothing. */
    if (more || !(without < (1.0 - threshold.change_explains) * first)) { /* the lag was another change's doing, too */
        memcpy(p->y - EDGE, as_read, (p->n + 2 * EDGE) * sizeof *as_read);
        changes->shifts = 0;
        changes->before_um = sqrt(all / (double)p->n);
        without = all;
    }
    changes->left_um = sqrt(without / (double)p->n);
    for (size_t s = 0; s < changes->shifts; s++) {
        changes->shift[s].at = (size_t)fmax(0.0, (double)((long)(p->first + changes->shift[s].at) - lag));
    }
    merge_shifts(p, changes);
    free(residual);
    free(kept);
    free(original);
    free(as_read);
}

/* Two clocks, or shifts: what leaves less. */
static void find_in_time(problem_t *p, double rate_hz, double log_chance_limit, changes_t *changes) {
    double *residual = allocate(p->n, sizeof *residual), *as_read = allocate(p->n + 2 * EDGE, sizeof *as_read);
    const double all = problem_residual(p, residual);
    lag_course_t saw;
    memcpy(as_read, p->y - EDGE, (p->n + 2 * EDGE) * sizeof *as_read);
    clocks_find(p, rate_hz, residual, &saw);
    const bool one = fabs(fabs(saw.size) - 1.0) < threshold.one_sample + threshold.deviations * saw.sigma &&
                     threshold.deviations * saw.sigma < threshold.saw_known;
    const bool clocks = one && saw.log_chance < log_chance_limit &&
                        saw.left < (1.0 - threshold.change_explains) * all &&
                        sqrt(saw.left / (double)p->n) < threshold.shift_near_noise * p->prediction->noise_um &&
                        saw.teeth_per_s * (double)p->n / rate_hz >= threshold.least_teeth;
    find_shifts(p, log_chance_limit, changes);
    const double left = changes->left_um * changes->left_um * (double)p->n;
    if (clocks && (changes->shifts == 0 || saw.left < left)) {
        memcpy(p->y - EDGE, as_read, (p->n + 2 * EDGE) * sizeof *as_read);
        memset(changes, 0, sizeof *changes);
        changes->before_um = sqrt(all / (double)p->n);
        changes->left_um = sqrt(saw.left / (double)p->n);
        changes->clocks = saw;
    }
    free(residual);
    free(as_read);
}

/* Sums in windows of what gain and offset from an instant on need: products with the columns, with each other, with
 * the readings. */
static trial_t best_switch(const problem_t *p, const double *path) {
    const size_t m = p->columns, width = m + 3;
    double *sums = allocate(ADDED * p->windows * width, sizeof *sums), *total = allocate(ADDED * width, sizeof *total);
    double *white = allocate(ADDED * m, sizeof *white), *y_white = allocate(m, sizeof *y_white);
    double *products = allocate(m, sizeof *products);
    trial_t best = {0, 0, HUGE_VAL};
    for (size_t c = 0; c < m; c++) {
        products[c] = problem_dot(p->column[c], p->y, p->n);
    }
    problem_whiten(p, products, y_white);
    const double all = problem_dot(p->y, p->y, p->n) - problem_dot(y_white, y_white, m);
    for (size_t w = 0; w < p->windows; w++) {
        for (size_t k = p->from[w]; k < p->from[w + 1]; k++) {
            const double added[ADDED] = {1.0, path[k]};
            for (size_t a = 0; a < ADDED; a++) {
                double *sum = sums + (a * p->windows + w) * width;
                for (size_t c = 0; c < m; c++) {
                    sum[c] += added[a] * p->column[c][k];
                }
                sum[m] += added[a];
                sum[m + 1] += added[a] * path[k];
                sum[m + 2] += added[a] * p->y[k];
            }
        }
    }
    for (size_t w = p->windows; w-- > 1;) {
        for (size_t i = 0; i < ADDED * width; i++) {
            total[i] += sums[(i / width * p->windows + w) * width + i % width];
        }
        if ((double)w < threshold.least_side * (double)p->windows ||
            (double)(p->windows - w) < threshold.least_side * (double)p->windows) {
            continue;
        }
        problem_whiten(p, total, white);
        problem_whiten(p, total + width, white + m);
        const double s11 = total[m] - problem_dot(white, white, m),
                     s12 = total[m + 1] - problem_dot(white, white + m, m);
        const double s22 = total[width + m + 1] - problem_dot(white + m, white + m, m);
        const double r1 = total[m + 2] - problem_dot(white, y_white, m),
                     r2 = total[width + m + 2] - problem_dot(white + m, y_white, m);
        const double determinant = s11 * s22 - s12 * s12;
        const double taken = determinant > 1e-9 * s11 * s22
                                 ? (r1 * r1 * s22 - 2.0 * r1 * r2 * s12 + r2 * r2 * s11) / determinant
                                 : r1 * r1 / s11;
        if (all - taken < best.left) {
            best = (trial_t){w, 0, all - taken};
        }
    }
    free(sums);
    free(total);
    free(white);
    free(y_white);
    free(products);
    return best;
}

/* Fits gain and offset from a row on beside the columns. Returns the sum of squares that is left. */
static double fit_switch(const problem_t *p, const double *path, size_t row, size_t numbers, look_regression_t *fit,
                         double *residual) {
    const size_t m = p->columns;
    const double *column[LOOK_MOST_COLUMNS];
    double *added = allocate(ADDED * p->n, sizeof *added), squares = 0.0;
    for (size_t k = row; k < p->n; k++) {
        added[k] = 1.0;
        added[p->n + k] = path[k];
    }
    for (size_t c = 0; c < m; c++) {
        column[c] = p->column[c];
    }
    column[m] = added;
    column[m + 1] = added + p->n;
    look_regress(column, m + numbers, p->y, NULL, p->n, fit);
    for (size_t c = numbers; c < ADDED; c++) {
        fit->coefficient[m + c] = fit->sigma[m + c] = 0.0;
    }
    for (size_t k = 0; k < p->n; k++) {
        residual[k] = p->y[k];
        for (size_t c = 0; c < m + ADDED; c++) {
            residual[k] -= fit->coefficient[c] * column[c][k];
        }
        squares += residual[k] * residual[k];
    }
    free(added);
    return squares;
}

/* The sample: where the readings stop to be better without the switch than with it. */
static size_t refine_switch(const problem_t *p, const double *path, const trial_t *trial, const look_regression_t *fit,
                            const double *residual, size_t *within) {
    const size_t middle = p->from[trial->window], first = p->from[trial->window - 1];
    const size_t last = trial->window + 1 < p->windows ? p->from[trial->window + 1] : p->n;
    const double unit = problem_dot(residual, residual, p->n) / (double)p->n;
    double least = 0.0;
    size_t best = first, from, to;
    for (int pass = 0; pass < 2; pass++) {
        double sum = 0.0;
        from = pass == 0 ? last : best;
        to = pass == 0 ? first : best;
        for (size_t k = first; k < last; k++) {
            const double jump = fit->coefficient[p->columns] + fit->coefficient[p->columns + 1] * path[k];
            const double with = k >= middle ? residual[k] : residual[k] - jump;
            const double without = k >= middle ? residual[k] + jump : residual[k];
            sum += without * without - with * with;
            if (pass == 0 && sum < least) {
                least = sum;
                best = k + 1;
            } else if (pass == 1 && sum < least + threshold.switch_within * threshold.switch_within * unit) {
                from = k + 1 < from ? k + 1 : from;
                to = k + 1 > to ? k + 1 : to;
            }
        }
    }
    *within = best - from > to - best ? best - from : to - best;
    return best;
}

/* The path holds some of the change itself. What the columns alone make of it is the position before; gain and offset
 * are to be those of that. */
static void relative_to_before(const problem_t *p, const double *path, const look_regression_t *fit, double *gain,
                               double *offset_um) {
    double *before = allocate(2 * p->n, sizeof *before), *ones = before + p->n;
    double *added = allocate(p->n, sizeof *added);
    const double *const column[] = {ones, before};
    look_regression_t line;
    for (size_t k = 0; k < p->n; k++) {
        for (size_t c = 0; c < p->columns; c++) {
            before[k] += fit->coefficient[c] * p->column[c][k];
        }
        ones[k] = 1.0;
        added[k] = *offset_um + *gain * path[k];
    }
    if (*gain != 0.0 && look_regress(column, 2, added, NULL, p->n, &line)) {
        *offset_um = line.coefficient[0];
        *gain = line.coefficient[1];
    }
    free(before);
    free(added);
}

/* Whether the readings beside the path jump there. */
static jump_t switches_at(const problem_t *p, const double *path, size_t row, double height) {
    double *beside = allocate(p->n, sizeof *beside);
    for (size_t k = 0; k < p->n; k++) {
        beside[k] = p->y[k] - path[k];
    }
    const jump_t jump = jumps_by(p, beside, row, height);
    free(beside);
    return jump;
}

/* What the columns alone make of the position, with a switch beside them: the path that gain and offset act on. Begun
 * with the readings themselves, as what the columns make of them without a switch has some of it in it. */
static void path_before(const problem_t *p, size_t row, double *path, double *residual) {
    enum { ROUNDS = 3 };
    look_regression_t fit;
    memcpy(path, p->y, p->n * sizeof *path);
    for (size_t round = 0; round < ROUNDS; round++) {
        fit_switch(p, path, row, ADDED, &fit, residual);
        memset(path, 0, p->n * sizeof *path);
        for (size_t c = 0; c < p->columns; c++) {
            for (size_t k = 0; k < p->n && fit.coefficient[c] != 0.0; k++) {
                path[k] += fit.coefficient[c] * p->column[c][k];
            }
        }
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

/* Of the windows around the one that a path with some of the switch in it points to, that which leaves least with the
 * path without. */
static void settle_switch(const problem_t *p, trial_t *trial, double *path, double *residual) {
    double *tried = allocate(p->n, sizeof *tried), *best = allocate(p->n, sizeof *best), least = HUGE_VAL;
    const size_t first = trial->window > 1 ? trial->window - 1 : 1, last = trial->window + 1;
    for (size_t w = first; w <= last && w < p->windows; w++) {
        look_regression_t fit;
        path_before(p, p->from[w], tried, residual);
        const double left = fit_switch(p, tried, p->from[w], ADDED, &fit, residual);
        if (left < least) {
            least = left;
            trial->window = w;
            memcpy(best, tried, p->n * sizeof *best);
        }
    }
    memcpy(path, best, p->n * sizeof *path);
    free(tried);
    free(best);
}

/* One switch more. false: there is none. */
static bool find_switch(problem_t *p, const drive_look_t *drive, double *path, double middle_um,
                        double log_chance_limit, double *without, double *residual, changes_t *changes) {
    enum { SETTLES = 6 };
    trial_t trial = best_switch(p, path);
    switch_t *change = &changes->change[changes->switches];
    look_regression_t fit;
    if (trial.window == 0 || !(trial.left < (1.0 - threshold.change_explains) * *without)) {
        return false;
    }
    for (size_t round = 0, window = 0; round < SETTLES && window != trial.window; round++) {
        window = trial.window;
        settle_switch(p, &trial, path, residual);
    }
    fit_switch(p, path, p->from[trial.window], ADDED, &fit, residual);
    const size_t at = refine_switch(p, path, &trial, &fit, residual, &change->within);
    const double alone = fit_switch(p, path, at, 1, &fit, residual);
    double with = fit_switch(p, path, at, ADDED, &fit, residual);
    if (!(problem_chance(alone, with, residual, p->n, 1.0, 1.0) < log_chance_limit)) { /* an offset is enough */
        with = fit_switch(p, path, at, 1, &fit, residual);
    }
    change->log_chance = problem_chance(*without, with, residual, p->n, ADDED, (double)p->n);
    const double height = fit.coefficient[p->columns] + fit.coefficient[p->columns + 1] * path[at < p->n ? at : at - 1];
    const bool all = with < (1.0 - threshold.change_explains) * *without &&
                     sqrt(with / (double)p->n) < threshold.change_at_noise * p->noise_um;
    const jump_t jump = switches_at(p, path, at, height);
    const size_t window = p->from[1] - p->from[0];
    if (!(change->log_chance < log_chance_limit) || !(jump == JUMPS || (jump == CANNOT_SAY && all)) ||
        drive_turns(drive, p->first + at, change->within + window)) {
        return false;
    }
    const residual_run_t run = {residual, p->n};
    const double widen = sqrt(autocorrelation_time(&run, 1));
    double gain = fit.coefficient[p->columns + 1], offset_um = fit.coefficient[p->columns];
    relative_to_before(p, path, &fit, &gain, &offset_um);
    change->at = p->first + at;
    change->gain = 1.0 + gain;
    /* The path is no better known than what is left. */
    const double of_path = gain * sqrt(with / (double)p->n) / look_deviation(path, p->n);
    change->gain_sigma = hypot(fit.sigma[p->columns + 1] * widen, of_path);
    change->offset_um = offset_um - gain * middle_um;
    change->offset_sigma_um = hypot(fit.sigma[p->columns] * widen, change->gain_sigma * middle_um);
    for (size_t k = at; k < p->n; k++) {
        p->y[k] -= fit.coefficient[p->columns] + fit.coefficient[p->columns + 1] * path[k];
    }
    *without = with;
    changes->left_um = sqrt(with / (double)p->n);
    changes->switches++;
    return true;
}

static void find_switches(problem_t *p, const drive_look_t *drive, const double *path, double middle_um,
                          double log_chance_limit, changes_t *changes) {
    double *residual = allocate(p->n, sizeof *residual), *before = allocate(p->n, sizeof *before);
    double without = problem_residual(p, residual);
    bool more = true;
    while (more && changes->switches < CHANGES_MOST) {
        memcpy(before, path, p->n * sizeof *before);
        more = find_switch(p, drive, before, middle_um, log_chance_limit, &without, residual, changes);
    }
    free(residual);
    free(before);
}

/* Readings with the wrong ones replaced by the mean of their neighbours, less the middle. */
static void fill_readings(const recording_t *recording, const wrong_t *wrong, double middle_um, double *y) {
    const double *reading = recording->column[COLUMN_DISPLACEMENT];
    for (size_t k = 0; k < recording->samples; k++) {
        y[k] = reading[k] - middle_um;
    }
    for (size_t i = 0; i < wrong->count; i++) {
        size_t next = i;
        while (next + 1 < wrong->count && wrong->at[next + 1] == wrong->at[next] + 1) {
            next++;
        }
        const size_t from = wrong->at[i] - 1, to = wrong->at[next] + 1;
        for (size_t k = from + 1; k < to; k++) {
            y[k] = y[from] + (y[to] - y[from]) * (double)(k - from) / (double)(to - from);
        }
        i = next;
    }
}

void changes_find(const recording_t *recording, const drive_look_t *drive, const reference_t *reference,
                  const prediction_t *prediction, double noise_um, const wrong_t *wrong, double log_chance_limit,
                  changes_t *changes) {
    const size_t samples = recording->samples, from = reference->plays_from, span_from = reference->span.from;
    const size_t start = from > span_from ? (from > EDGE ? from : EDGE) : (span_from > EDGE ? span_from : EDGE);
    const size_t end = reference->span.to + EDGE < samples ? reference->span.to : samples - EDGE;
    memset(changes, 0, sizeof *changes);
    if (drive->kind == DRIVE_RESTS || (double)end < (double)start + threshold.least_for_changes) {
        return;
    }
    problem_t p = {.n = end - start,
                   .first = start,
                   .prediction = prediction,
                   .noise_um = noise_um,
                   .columns = reference_columns_count(reference, samples)};
    const double middle_um = look_mean(recording->column[COLUMN_DISPLACEMENT], samples);
    double *columns = allocate((p.columns + DRIFTS) * samples, sizeof *columns), *y = allocate(samples, sizeof *y);
    const double *column[LOOK_MOST_COLUMNS];
    reference_columns(recording, drive, reference, columns);
    fill_readings(recording, wrong, middle_um, y);
    for (size_t c = 0; c < p.columns; c++) {
        column[c] = columns + c * samples + start;
    }
    p.column = column;
    p.y = y + start;
    p.windows = p.n / LEAST_WINDOW < MOST_WINDOWS ? p.n / LEAST_WINDOW : MOST_WINDOWS;
    p.from = allocate(p.windows + 1, sizeof *p.from);
    for (size_t w = 0; w <= p.windows; w++) {
        p.from[w] = w * p.n / p.windows;
    }
    p.scale = allocate(p.columns + DRIFTS, sizeof *p.scale);
    p.factor = allocate((p.columns + DRIFTS) * (p.columns + DRIFTS), sizeof *p.factor);
    problem_factorise(&p);
    double *const drift[DRIFTS] = {columns + p.columns * samples + start, columns + (p.columns + 1) * samples + start};
    p.columns = problem_independent(&p, column); /* of a drive between few levels nearly none is */
    problem_factorise(&p);
    find_in_time(&p, recording->sample_rate_hz, log_chance_limit, changes);
    /* Gain and offset that drift are no switch. The path is what the columns make of the readings that are set right.
     */
    double *path = allocate(p.n, sizeof *path), *residual = allocate(p.n, sizeof *residual);
    problem_residual(&p, residual);
    for (size_t k = 0; k < p.n; k++) {
        const double x = (double)k / (double)p.n;
        path[k] = p.y[k] - residual[k];
        drift[0][k] = x * x;
        drift[1][k] = x * path[k];
    }
    for (size_t i = 0; i < DRIFTS; i++) {
        column[p.columns++] = drift[i];
    }
    problem_factorise(&p);
    if (changes->clocks.size == 0.0) {
        find_switches(&p, drive, path, middle_um, log_chance_limit, changes);
    }
    free(path);
    free(residual);
    free(columns);
    free(y);
    free(p.from);
    free(p.scale);
    free(p.factor);
}
