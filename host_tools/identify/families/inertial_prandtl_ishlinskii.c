/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Play form with inertia and damping, blocks prandtl_ishlinskii and inertial_terms:
 *
 *     y = f - c f' - m f'',      f = offset + w_0 u + sum w_i play_i[u]
 *
 * Linear in offset and weights for given c and m. Its normal equations follow for every (c, m) from those of all
 * columns and of their two differences, so the recordings are read once, and (c, m) is searched.
 */
#include "chain/catalogue.h"
#include "identify/family.h"
#include "identify/play_basis.h"
#include "numerics/least_squares.h"
#include "numerics/simplex.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { DEFAULT_OPERATORS = 10, MOST_OPERATORS = 64, MOST_ITERATIONS = 200 };
/* Columns: 1, then of u and of every play its value, rate and acceleration. */
enum { FORMS = 3, MOST_COLUMNS = 1 + FORMS * (MOST_OPERATORS + 1) };

/* As in fit.c: w_0 is at least this part of the mean slope, or the inverse jumps at every turning point. */
static const double direct_part = 0.3;

typedef struct {
    const family_job_t *job;
    play_basis_t basis;
    normal_equations_t all;
    double rate_hz, center_v, center_um, least_direct;
    double x[2 + MOST_OPERATORS]; /* offset and weights of the last pair */
    double tried;                 /* pairs */
    failure_t *failure;
} search_t;

static bool measure_ranges(search_t *search, double *half_v) {
    double low[2] = {HUGE_VAL, HUGE_VAL}, high[2] = {-HUGE_VAL, -HUGE_VAL}, slope = HUGE_VAL;
    *half_v = 0.0;
    for (size_t i = 0; i < search->job->count; i++) {
        const recording_t *recording = &search->job->recordings[i];
        const column_t columns[2] = {COLUMN_DRIVE, COLUMN_DISPLACEMENT};
        double span[2];
        for (size_t c = 0; c < 2; c++) {
            const double *value = recording->column[columns[c]];
            double least = value[0], most = value[0];
            for (size_t k = 1; k < search->job->train_to[i]; k++) {
                least = fmin(least, value[k]);
                most = fmax(most, value[k]);
            }
            span[c] = most - least;
            low[c] = fmin(low[c], least);
            high[c] = fmax(high[c], most);
        }
        if (!(span[0] > 0.0) || !(span[1] > 0.0)) {
            return fail(search->failure, "%s: nothing moves in its training part", recording->name);
        }
        *half_v = fmax(*half_v, 0.5 * span[0]);
        slope = fmin(slope, span[1] / span[0]);
    }
    search->center_v = 0.5 * (low[0] + high[0]);
    search->center_um = 0.5 * (low[1] + high[1]);
    search->least_direct = direct_part * slope;
    return true;
}

/* The rows of one recording. past[0..2] are the columns at this sample and the two before it. */
static void add_recording(search_t *search, const recording_t *recording, size_t to) {
    const double faster = recording->sample_rate_hz / search->rate_hz;
    const size_t n = search->basis.operators,
                 from = play_memory_as_determined_as_possible(&search->basis, recording, to);
    double past[3][MOST_OPERATORS + 1] = {{0}}, row[MOST_COLUMNS] = {1.0};
    play_walk_t walk;
    play_walk_begin(&walk, &search->basis, recording, NULL);
    for (size_t k = 0; k < to; k++) {
        memmove(past[1], past[0], 2 * sizeof past[0]);
        play_walk_step(&walk);
        past[0][0] = walk.drive[k] - search->center_v;
        for (size_t i = 0; i < n; i++) {
            past[0][i + 1] = walk.memory_v[i] - search->center_v;
        }
        if (k < from + 2) {
            continue;
        }
        for (size_t i = 0; i <= n; i++) {
            row[1 + FORMS * i] = past[0][i];
            row[2 + FORMS * i] = faster * (1.5 * past[0][i] - 2.0 * past[1][i] + 0.5 * past[2][i]);
            row[3 + FORMS * i] = faster * faster * (past[0][i] - 2.0 * past[1][i] + past[2][i]);
        }
        normal_equations_add(&search->all, row, recording->column[COLUMN_DISPLACEMENT][k] - search->center_um);
    }
    play_walk_end(&walk);
}

/* What column i of the reduced problem takes of the columns of the whole: `count` of them from `first` on. */
static size_t mixture(size_t i, double c, double m, double part[FORMS], size_t *first) {
    part[0] = 1.0;
    part[1] = -c;
    part[2] = -m;
    *first = i == 0 ? 0 : 1 + FORMS * (i - 1);
    return i == 0 ? 1 : FORMS;
}

/* The best offset and weights for c and m in samples: fills search->x. Returns the squared error, HUGE_VAL on failure.
 */
static double solve(search_t *search, double c, double m) {
    const size_t n = 2 + search->basis.operators, whole = search->all.unknowns;
    double lower[2 + MOST_OPERATORS] = {-HUGE_VAL, search->least_direct}, error;
    normal_equations_t reduced;
    normal_equations_create(&reduced, n);
    reduced.rows = search->all.rows;
    reduced.power = search->all.power;
    for (size_t i = 0; i < n; i++) {
        double left[FORMS], right[FORMS];
        size_t row, column;
        const size_t rows = mixture(i, c, m, left, &row);
        for (size_t r = 0; r < rows; r++) {
            reduced.moment[i] += left[r] * search->all.moment[row + r];
        }
        for (size_t j = 0; j < n; j++) {
            const size_t columns = mixture(j, c, m, right, &column);
            for (size_t r = 0; r < rows; r++) {
                for (size_t s = 0; s < columns; s++) {
                    reduced.gram[i * n + j] += left[r] * right[s] * search->all.gram[(row + r) * whole + column + s];
                }
            }
        }
    }
    error = solve_bounded(&reduced, lower, search->x, NULL, search->failure) ? squared_error(&reduced, search->x)
                                                                             : HUGE_VAL;
    normal_equations_free(&reduced);
    return error;
}

/* Of the square roots of c and m, which keeps them from falling below 0. */
static double error_of_roots(const double *roots, void *context) {
    search_t *search = context;
    progress_update(search->job->progress, search->tried++ / (2.0 * MOST_ITERATIONS));
    return solve(search, roots[0] * roots[0], roots[1] * roots[1]);
}

static void search_pair(search_t *search, double *c, double *m) {
    const simplex_job_t job = {.function = error_of_roots,
                               .context = search,
                               .dimensions = 2,
                               .step = 0.5,
                               .size = 1e-6,
                               .most_iterations = MOST_ITERATIONS};
    double roots[2] = {1.0, 1.0}; /* a sample, a sample squared */
    (void)simplex_minimise(&job, roots);
    *c = pow(roots[0], 2.0);
    *m = pow(roots[1], 2.0);
}

static void make_model(const search_t *search, double c, double m, model_t *model) {
    const size_t n = search->basis.operators;
    double offset = search->x[0] + search->center_um;
    for (size_t i = 0; i <= n; i++) {
        offset -= search->x[1 + i] * search->center_v;
    }
    model_create(model, search->rate_hz);
    model_block_t *block = model_append(model, &block_prandtl_ishlinskii);
    model_set(block, "offset_um", offset);
    model_set_array(block, "weights", n + 1, search->x + 1, NULL);
    model_set_array(block, "thresholds_v", n, search->basis.threshold_v, NULL);
    block = model_append(model, &block_inertial_terms);
    model_set(block, "damping_s", c / search->rate_hz);
    model_set(block, "mass_s2", m / (search->rate_hz * search->rate_hz));
}

static bool fit(const family_job_t *job, model_t *model, family_notes_t *notes, failure_t *failure) {
    search_t search = {.job = job, .rate_hz = recordings_fastest_hz(job->recordings, job->count), .failure = failure};
    const size_t n = job->operators > 0 ? job->operators : DEFAULT_OPERATORS;
    double threshold_v[MOST_OPERATORS], half_v, c, m;
    bool good;
    if (n > MOST_OPERATORS) {
        return fail(failure, "this family has at most %d operators", MOST_OPERATORS);
    }
    if (!measure_ranges(&search, &half_v)) {
        return false;
    }
    for (size_t i = 0; i < n; i++) {
        threshold_v[i] = half_v * (double)(i + 1) / (double)(n + 1);
    }
    search.basis = (play_basis_t){.operators = n, .threshold_v = threshold_v};
    normal_equations_create(&search.all, 1 + FORMS * (n + 1));
    for (size_t i = 0; i < job->count; i++) {
        add_recording(&search, &job->recordings[i], job->train_to[i]);
    }
    normal_equations_finish(&search.all);
    search_pair(&search, &c, &m);
    good = isfinite(solve(&search, c, m));
    if (good) {
        make_model(&search, c, m, model);
        family_note(notes, "first-order expansion of a mode: good while 2 pi f %.3g s and its square stay small",
                    fmax(c, sqrt(m)) / search.rate_hz);
    }
    normal_equations_free(&search.all);
    return good;
}

const family_t family_inertial_prandtl_ishlinskii = {
    .name = "inertial_prandtl_ishlinskii",
    .order = 70,
    .text =
        "plays of the drive, less terms in the rate and acceleration of their sum; recordings at several frequencies",
    .fit = fit,
    .without = &family_prandtl_ishlinskii};
