/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "look/path/shifts.h"
#include "base/parallel.h"
#include "look/path/jump.h"
#include "look/path/lag_steps.h"
#include "numerics/autocorrelation.h"
#include "thresholds/thresholds.h"
#include <gsl/gsl_cblas.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum { EDGE = PROBLEM_EDGE, SHIFTS = 2 * CHANGES_MOST_SHIFT, LAGS = SHIFTS + 1 };

typedef struct {
    problem_t *p; /* readings: set right for what was found so far */
    changes_t *changes;
    double *original, *kept; /* readings with a lag of all of them taken out; those before a trial */
    double *residual;        /* of the readings */
    double first;            /* square that is left of the original */
    long lag;                /* that was taken out */
} search_t;

typedef struct {
    size_t window;
    int samples;
    double left;
} trial_t;

static int by_left(const void *a, const void *b) {
    const double x = ((const trial_t *)a)->left, y = ((const trial_t *)b)->left;
    return x < y ? -1 : x > y ? 1 : 0;
}

/* Shifts that are tried side by side: each task writes its own best instant. */
typedef struct {
    const problem_t *p;
    const double *products; /* of the readings with each shift, the last one 0, with the columns, by window */
    trial_t *best;
} shifts_tried_t;

/* One of all shifts but 0; the last one is 0. */
static int shift_of(size_t index) {
    const int d = (int)index - CHANGES_MOST_SHIFT;
    return index == SHIFTS ? 0 : d < 0 ? d : d + 1;
}

/* Square of the readings with a shift in one window. */
static double window_square(const problem_t *p, int samples, size_t window) {
    const double *from = p->y - samples + p->from[window];
    return problem_dot(from, from, p->from[window + 1] - p->from[window]);
}

static void best_instant(void *context, size_t index) {
    const shifts_tried_t *tried = context;
    const problem_t *p = tried->p;
    const size_t m = p->columns, all = p->windows * m;
    const int d = shift_of(index);
    const double *behind = tried->products + index * all, *before = tried->products + SHIFTS * all;
    /* By the window from which on the readings are shifted: their products with the columns, their square. */
    double *sum = allocate(all, sizeof *sum), *square = allocate(p->windows, sizeof *square);
    trial_t best = {0, d, HUGE_VAL};
    for (size_t w = 0; w < p->windows; w++) {
        cblas_daxpy((int)m, 1.0, behind + w * m, 1, sum, 1);
        square[0] += window_square(p, d, w);
    }
    for (size_t w = 1; w < p->windows; w++) {
        for (size_t c = 0; c < m; c++) {
            sum[w * m + c] = sum[(w - 1) * m + c] + (before[(w - 1) * m + c] - behind[(w - 1) * m + c]);
        }
        square[w] = square[w - 1] + (window_square(p, 0, w - 1) - window_square(p, d, w - 1));
    }
    column_factor_whiten(&p->factor, sum, p->windows, m);
    for (size_t w = 1; w < p->windows; w++) {
        const double left = square[w] - problem_dot(sum + w * m, sum + w * m, m);
        best = problem_has_sides(p, w) && left < best.left ? (trial_t){w, d, left} : best;
    }
    tried->best[index] = best;
    free(sum);
    free(square);
}

/* The best instant of each shift on the grid, the best first. */
static void best_shifts(const problem_t *p, trial_t best[SHIFTS]) {
    double *products = allocate((SHIFTS + 1) * p->windows * p->columns, sizeof *products);
    const double *shifted[SHIFTS + 1];
    for (size_t i = 0; i <= SHIFTS; i++) {
        shifted[i] = p->y - shift_of(i);
    }
    problem_window_products(p, shifted, SHIFTS + 1, NULL, 0, products);
    parallel(SHIFTS, best_instant, &(shifts_tried_t){p, products, best});
    free(products);
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

/* What an independent sample of the residual has. What the reference cannot follow stays for a while: so many samples
 * count as one. */
static double unit_of(const search_t *s) {
    const residual_run_t run = {s->residual, s->p->n};
    return problem_dot(s->residual, s->residual, s->p->n) / (double)s->p->n * autocorrelation_time(&run, 1);
}

/* The sample, from what readings of either kind leave beside the fit around the instant. */
static size_t refine_shift(const search_t *s, const trial_t *trial, size_t *within) {
    enum { AROUND = 4 }; /* windows: where the motion turns, noise decides which of them is best */
    const problem_t *p = s->p;
    const double *y_before = s->kept + EDGE;
    const size_t first = p->from[trial->window > AROUND ? trial->window - AROUND : 1],
                 last = trial->window + AROUND < p->windows ? p->from[trial->window + AROUND] : p->n - EDGE;
    double *gains = allocate(p->n, sizeof *gains);
    /* residual is that of readings which are shifted from the window on; fit = right reading - residual. */
    for (size_t k = first; k < last; k++) {
        const double fit = p->y[k] - s->residual[k];
        const double unshifted = y_before[k] - fit, shifted = y_before[(long)k - trial->samples] - fit;
        gains[k] = unshifted * unshifted - shifted * shifted;
    }
    const double slack = threshold.deviations * threshold.deviations * unit_of(s);
    const size_t best = problem_instant(gains, first, last, slack, within);
    free(gains);
    return best;
}

/* Sets the readings right for all shifts but one (`but` = shifts: for all), from the last to the first, so that each is
 * applied where its reading was. Returns the square that the columns leave. */
static double set_right(search_t *s, size_t but, double *residual) {
    const changes_t *changes = s->changes;
    size_t below = SIZE_MAX;
    problem_restore(s->p, s->original);
    for (size_t left = changes->shifts; left > 0; left--) {
        size_t last = changes->shifts;
        for (size_t i = 0; i < changes->shifts; i++) {
            const bool next = changes->shift[i].at < below &&
                              (last == changes->shifts || changes->shift[i].at > changes->shift[last].at);
            last = next ? i : last;
        }
        if (last == changes->shifts) {
            break;
        }
        below = changes->shift[last].at;
        if (last != but) {
            apply_shift(s->p, below, changes->shift[last].samples);
        }
    }
    return problem_residual(s->p, residual);
}

/* Row of a shift, with the readings before it set right; and the other way round. */
static size_t row_of(const changes_t *changes, size_t which) {
    long row = (long)changes->shift[which].at;
    for (size_t i = 0; i < changes->shifts; i++) {
        row += changes->shift[i].at < changes->shift[which].at ? changes->shift[i].samples : 0;
    }
    return (size_t)(row > 0 ? row : 0);
}

static size_t reading_at(const changes_t *changes, size_t row) {
    long reading = (long)row;
    for (size_t i = 0; i < changes->shifts; i++) {
        reading -= row_of(changes, i) <= row ? changes->shift[i].samples : 0;
    }
    return (size_t)(reading > 0 ? reading : 0);
}

/* Tries one shift more. false, and all is as before: it does not hold. */
static bool try_shift(search_t *s, const trial_t *trial, double without, double *with) {
    problem_t *p = s->p;
    changes_t *changes = s->changes;
    shift_t *shift = &changes->shift[changes->shifts];
    size_t row = p->from[trial->window];
    problem_keep(p, s->kept);
    for (size_t pass = 0; pass < 2; pass++) { /* from the window on some readings were not right: once more */
        problem_restore(p, s->kept);
        apply_shift(p, row, trial->samples);
        problem_residual(p, s->residual);
        row = refine_shift(s, trial, &shift->within);
    }
    const size_t moved = (size_t)abs(trial->samples); /* what was lost, or is there twice, belongs to either side */
    shift->within = shift->within > moved ? shift->within : moved;
    shift->at = reading_at(changes, row);
    shift->samples = trial->samples;
    changes->shifts++;
    *with = set_right(s, changes->shifts, s->residual);
    shift->log_chance = problem_chance(p, without, *with, s->residual, 1.0, (double)p->n * SHIFTS);
    if (shift->log_chance < p->log_chance_limit && *with < threshold.shift_leaves * without) {
        return true;
    }
    changes->shifts--;
    problem_restore(p, s->kept);
    return false;
}

/* Whether a shift holds beside all others: what the readings do at its instant, and what it explains. right: readings
 * that are set right for all; they leave `with`. */
static bool holds(search_t *s, double with, const double *right, size_t which) {
    problem_t *p = s->p;
    shift_t *shift = &s->changes->shift[which];
    const size_t at = row_of(s->changes, which);
    double *beside = allocate(p->n, sizeof *beside);
    const double slope = at > 3 && at + 3 < p->n ? (right[at + 3] - right[at - 3]) / 6.0 : 0.0;
    const double without = set_right(s, which, beside);
    for (size_t k = 0; k < p->n; k++) { /* readings without it, beside what the columns make of them with it */
        beside[k] = p->y[k] - (right[k] - s->residual[k]);
    }
    const jump_t jump = jumps_around(p, beside, at, shift->within, slope * (double)shift->samples);
    free(beside);
    const bool explains = with < (1.0 - threshold.change_explains) * s->first;
    const bool near = explains && problem_rms(p, with) < threshold.shift_near_noise * p->noise_um;
    const bool all = explains && problem_rms(p, with) < threshold.change_at_noise * p->noise_um;
    shift->log_chance = problem_chance(p, without, with, s->residual, 1.0, (double)p->n * SHIFTS);
    return shift->log_chance < p->log_chance_limit && (jump == JUMPS || (jump == CANNOT_SAY && near) || all);
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

/* What each lag of all readings leaves, side by side. */
typedef struct {
    const problem_t *p;
    double left[LAGS];
} lags_tried_t;

static void try_lag(void *context, size_t index) {
    lags_tried_t *tried = context;
    const problem_t *p = tried->p;
    double *white = allocate(p->columns, sizeof *white);
    tried->left[index] = problem_left(p, p->y - ((int)index - CHANGES_MOST_SHIFT), white);
    free(white);
}

/* A lag that was there all the time is no change: the readings are shifted as a whole as long as that leaves less than
 * `without`. Returns what is left then. */
static double take_lag_out(problem_t *p, double without, long *lag) {
    enum { MOST_ROUNDS = 3 };
    double *residual = allocate(p->n, sizeof *residual);
    lags_tried_t tried = {.p = p};
    for (size_t round = 0; round < MOST_ROUNDS; round++) {
        int best = 0;
        double least = threshold.shift_leaves * without;
        parallel(LAGS, try_lag, &tried);
        for (size_t i = 0; i < LAGS; i++) {
            if (tried.left[i] < least) {
                least = tried.left[i];
                best = (int)i - CHANGES_MOST_SHIFT;
            }
        }
        if (best == 0) {
            break;
        }
        apply_shift(p, 0, best);
        *lag += best;
        without = problem_residual(p, residual);
    }
    free(residual);
    return without;
}

/* Takes off what does not hold beside the others, one after the other. Returns what is left then. */
static double prune_shifts(search_t *s) {
    changes_t *changes = s->changes;
    double *right = allocate(s->p->n, sizeof *right), with = 0.0;
    for (bool again = true; again;) {
        size_t worst = changes->shifts;
        with = set_right(s, changes->shifts, s->residual);
        memcpy(right, s->p->y, s->p->n * sizeof *right);
        for (size_t i = 0; i < changes->shifts; i++) {
            if (!holds(s, with, right, i) &&
                (worst == changes->shifts || changes->shift[i].log_chance > changes->shift[worst].log_chance)) {
                worst = i;
            }
        }
        again = worst < changes->shifts;
        if (again) {
            changes->shift[worst] = changes->shift[--changes->shifts];
        }
    }
    set_right(s, changes->shifts, s->residual);
    free(right);
    return with;
}

/* All readings are late by so much, beside what was taken out before. */
static void take_whole_lag(search_t *s, int samples) {
    problem_restore(s->p, s->original);
    apply_shift(s->p, 0, samples);
    problem_keep(s->p, s->original);
    s->lag += samples;
}

/* With a shift set right the readings as a whole may stand better elsewhere. Returns what is left then. */
static double take_rest_out(search_t *s, double without) {
    problem_t *p = s->p;
    long more = 0;
    const double left = take_lag_out(p, without, &more);
    if (more == 0) {
        return left;
    }
    take_whole_lag(s, (int)more);
    for (size_t i = 0; i < s->changes->shifts; i++) {
        shift_t *shift = &s->changes->shift[i];
        shift->at = (size_t)fmax(0.0, (double)((long)shift->at + more));
    }
    return set_right(s, s->changes->shifts, s->residual);
}

/* Shifts at the beginning of windows, from the lag of each. false: they are too many, or not in their order. */
static bool take_steps(search_t *s, const int *lag) {
    const problem_t *p = s->p;
    changes_t *changes = s->changes;
    changes->shifts = 0;
    for (size_t w = 1; w < p->windows; w++) {
        const long at = (long)p->from[w] - (lag[w - 1] - lag[0]);
        if (lag[w] == lag[w - 1]) {
            continue;
        }
        if (changes->shifts == CHANGES_MOST ||
            at <= (changes->shifts > 0 ? (long)changes->shift[changes->shifts - 1].at : 0)) {
            return false;
        }
        changes->shift[changes->shifts++] = (shift_t){.at = (size_t)at, .samples = lag[w] - lag[w - 1]};
    }
    if (lag[0] != 0) {
        take_whole_lag(s, lag[0]);
    }
    return true;
}

/* What a shift has to be worth: as much as its chance may be. */
static double price_of(const search_t *s) {
    return 2.0 * log(10.0) * unit_of(s) * (log10((double)s->p->n * SHIFTS) - s->p->log_chance_limit);
}

/* Each shift once more beside the others, for its instant; one that does not hold goes. */
static double place_again(search_t *s, double left) {
    changes_t *changes = s->changes;
    for (size_t i = changes->shifts; i-- > 0;) {
        const size_t row = row_of(changes, i);
        trial_t trial = {.samples = changes->shift[i].samples};
        while (trial.window + 1 < s->p->windows && s->p->from[trial.window + 1] <= row) {
            trial.window++;
        }
        changes->shift[i] = changes->shift[--changes->shifts];
        const double without = set_right(s, changes->shifts, s->residual);
        if (!problem_has_sides(s->p, trial.window) || !try_shift(s, &trial, without, &left)) {
            left = without;
        }
    }
    return left;
}

/* All shifts at once: lags of windows beside what the columns make of the readings, then the columns anew. Returns what
 * is left. */
static double find_at_once(search_t *s) {
    enum { MOST_ROUNDS = 8 };
    problem_t *p = s->p;
    double *expected = allocate(p->n, sizeof *expected), left = problem_residual(p, s->residual);
    int *lag = allocate(p->windows, sizeof *lag);
    bool good = true;
    for (size_t round = 0; good && round < MOST_ROUNDS; round++) {
        const double before = left;
        for (size_t k = 0; k < p->n; k++) {
            expected[k] = p->y[k] - s->residual[k];
        }
        const double price = price_of(s);
        problem_restore(p, s->original);
        lag_steps(p, expected, price, lag);
        good = take_steps(s, lag);
        left = good ? set_right(s, s->changes->shifts, s->residual) : s->first;
        if (!(left < threshold.shift_leaves * before)) {
            break;
        }
    }
    free(expected);
    free(lag);
    if (!good) {
        s->changes->shifts = 0;
        problem_restore(p, s->original);
        return s->first;
    }
    return place_again(s, left);
}

/* As long as one more explains something. more: it did not end. Returns what is left. */
static double add_shifts(search_t *s, double without, bool *more) {
    const problem_t *p = s->p;
    *more = true;
    while (*more && s->changes->shifts < CHANGES_MOST) {
        trial_t trial[SHIFTS];
        *more = false;
        best_shifts(p, trial);
        for (size_t i = 0; i < SHIFTS && trial[i].left < threshold.shift_leaves * without && !*more; i++) {
            double with;
            if (try_shift(s, &trial[i], without, &with)) {
                without = take_rest_out(s, with);
                *more = true;
            }
        }
    }
    return without;
}

/* From the readings as they are: steps of all windows, or none, then shifts one after the other; what does not hold
 * goes. A search that does not end explains nothing. Returns what is left. */
static double search_from(search_t *s, bool at_once) {
    changes_t *changes = s->changes;
    bool more;
    changes->shifts = 0;
    problem_keep(s->p, s->original);
    double left = at_once ? find_at_once(s) : s->first;
    if (at_once && changes->shifts == 0) {
        return s->first;
    }
    left = add_shifts(s, left, &more);
    if (more) {
        changes->shifts = 0;
        left = s->first;
    } else if (changes->shifts > 0) {
        left = prune_shifts(s);
    }
    return left;
}

/* Of several shifts the first one that is taken may stand for all, and stays; steps that are taken at once may be of
 * what the columns cannot follow. What leaves less stands, and the readings are set right for it. */
static double search_both(search_t *s) {
    problem_t *p = s->p;
    double *begin = problem_copy(p);
    const long whole_lag = s->lag;
    double left = search_from(s, true);
    double *right = problem_copy(p);
    const changes_t at_once = *s->changes;
    const long lag_at_once = s->lag;
    problem_restore(p, begin);
    s->lag = whole_lag;
    const double one_by_one = search_from(s, false);
    if (at_once.shifts > 0 && left <= one_by_one) {
        problem_restore(p, right);
        *s->changes = at_once;
        s->lag = lag_at_once;
    } else {
        left = one_by_one;
    }
    free(begin);
    free(right);
    return left;
}

void shifts_find(problem_t *p, double all, changes_t *changes) {
    search_t s = {.p = p, .changes = changes};
    double *as_read = problem_copy(p);
    s.first = take_lag_out(p, all, &s.lag);
    s.original = problem_copy(p);
    s.kept = problem_copy(p);
    s.residual = allocate(p->n, sizeof *s.residual);
    changes->before_um = problem_rms(p, s.first);
    double left = search_both(&s);
    if (!(left < (1.0 - threshold.change_explains) * s.first)) { /* the lag was another change's doing, too */
        problem_restore(p, as_read);
        changes->shifts = 0;
        changes->before_um = problem_rms(p, all);
        left = all;
    }
    changes->left_um = problem_rms(p, left);
    for (size_t i = 0; i < changes->shifts; i++) {
        shift_t *shift = &changes->shift[i];
        shift->at = (size_t)fmax(0.0, (double)((long)(p->first + shift->at) - s.lag));
    }
    merge_shifts(p, changes);
    free(s.residual);
    free(s.kept);
    free(s.original);
    free(as_read);
}
