/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Finds the density form. For given beta, delta, a and b the problem is linear in the offset, the direct weight and
 * alpha, which are solved for each time. The plays of one fine bank, and their products with each other and with the
 * displacement, are computed once: the plays of any thresholds are interpolated between them, so that a trial costs no
 * pass through the recording. The final parameters are solved for with exact plays.
 */
#include "elements/stop_density.h"
#include "chain/catalogue.h"
#include "identify/family.h"
#include "identify/initial_memory.h"
#include "numerics/least_squares.h"
#include "numerics/simplex.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { DEFAULT_OPERATORS = 32, FINE = 128 };
/* Columns of the fine problem: 1, the drive (the play of threshold 0), the fine plays. */
enum { OFFSET, NODE, COLUMNS = NODE + FINE + 1 };
/* Columns of the small one. */
enum { SMALL_OFFSET, SMALL_DIRECT, SMALL_DENSITY, SMALL };

/* Lower bound of the direct weight of the drive, as a fraction of the mean slope. Without it the inverse may jump at
 * every reversal (a lag resembles hysteresis with small thresholds). */
static const double direct_part = 0.3;
/* A shape whose residuals are no larger than this times the best ones' is as good. */
static const double as_good = 1.001;

/* What is searched, relative to the largest level, and of beta a quarter of its logarithm: much the same steps matter
 * in all of them. */
enum { LOG_BETA, DELTA, INTERCEPT, TOP, SHAPE };
static const double shape_low[SHAPE] = {-1.75 /* flat to a thousandth */, -1.0, 0.0, 0.2};
static const double shape_high[SHAPE] = {1.5, 2.0, 0.5, 1.0};

typedef struct {
    const family_job_t *job;
    failure_t *failure;
    double range_v[2];   /* of the drive over the training data */
    double least_direct; /* um/V */
    double *level_v;
    size_t levels;
    normal_equations_t fine, small;
    double *column; /* COLUMNS: the density's plays, as a sum of fine ones */
    double *threshold_v, *weight;
} search_t;

static double center_v(const search_t *search) {
    return 0.5 * (search->range_v[0] + search->range_v[1]);
}

static double largest_level(const search_t *search) {
    return search->level_v[search->levels - 1];
}

static play_basis_t make_basis(size_t operators, double largest_v) {
    play_basis_t basis = {.operators = operators, .threshold_v = allocate(operators, sizeof(double))};
    for (size_t i = 0; i < operators; i++) {
        basis.threshold_v[i] = largest_v * (double)(i + 1) / (double)operators;
    }
    return basis;
}

static bool measure_ranges(search_t *search) {
    const family_job_t *job = search->job;
    double slope = HUGE_VAL, half_v = 0.0;
    search->range_v[0] = HUGE_VAL;
    search->range_v[1] = -HUGE_VAL;
    for (size_t i = 0; i < job->count; i++) {
        double low[2] = {HUGE_VAL, HUGE_VAL}, high[2] = {-HUGE_VAL, -HUGE_VAL};
        for (size_t c = 0; c < 2; c++) {
            const double *values = job->recordings[i].column[c == 0 ? COLUMN_DRIVE : COLUMN_DISPLACEMENT];
            for (size_t k = 0; k < job->train_to[i]; k++) {
                low[c] = fmin(low[c], values[k]);
                high[c] = fmax(high[c], values[k]);
            }
        }
        if (!(high[0] > low[0]) || !(high[1] > low[1])) {
            return fail(search->failure, "%s: the %s does not change in the training part: nothing to fit",
                        job->recordings[i].name, high[0] > low[0] ? "displacement" : "drive");
        }
        search->range_v[0] = fmin(search->range_v[0], low[0]);
        search->range_v[1] = fmax(search->range_v[1], high[0]);
        half_v = fmax(half_v, 0.5 * (high[0] - low[0]));
        slope = fmin(slope, (high[1] - low[1]) / (high[0] - low[0]));
    }
    search->least_direct = direct_part * slope;
    search->levels = job->operators > 0 ? job->operators : DEFAULT_OPERATORS;
    search->level_v = allocate(search->levels, sizeof(double));
    for (size_t j = 0; j < search->levels; j++) { /* a play as wide as half the range would never move */
        search->level_v[j] = half_v * (double)(j + 1) / (double)(search->levels + 1);
    }
    return true;
}

/* Adds the training samples: `fill` makes a row of the drive and the plays. */
static void add_samples(const search_t *search, const play_basis_t *basis, normal_equations_t *equations,
                        void (*fill)(const search_t *search, double drive_v, const double *play_v, double *row)) {
    double *row = allocate(equations->unknowns, sizeof(double));
    for (size_t i = 0; i < search->job->count; i++) {
        const recording_t *recording = &search->job->recordings[i];
        const size_t to = search->job->train_to[i], from = play_memory_as_determined_as_possible(basis, recording, to);
        play_walk_t walk;
        play_walk_begin(&walk, basis, recording, NULL);
        for (size_t k = 0; k < to; k++) {
            play_walk_step(&walk);
            if (k >= from) {
                fill(search, recording->column[COLUMN_DRIVE][k] - center_v(search), walk.memory_v, row);
                normal_equations_add(equations, row, recording->column[COLUMN_DISPLACEMENT][k]);
            }
        }
        play_walk_end(&walk);
    }
    normal_equations_finish(equations);
    free(row);
}

static void fill_fine(const search_t *search, double drive_v, const double *play_v, double *row) {
    row[OFFSET] = 1.0;
    row[NODE] = drive_v;
    for (size_t m = 0; m < FINE; m++) {
        row[NODE + 1 + m] = play_v[m] - center_v(search);
    }
}

static void fill_small(const search_t *search, double drive_v, const double *play_v, double *row) {
    row[SMALL_OFFSET] = 1.0;
    row[SMALL_DIRECT] = drive_v;
    row[SMALL_DENSITY] = 0.0;
    for (size_t j = 0; j < search->levels; j++) {
        row[SMALL_DENSITY] += search->weight[j] * (play_v[j] - center_v(search));
    }
}

static stop_density_t make_density(const search_t *search, const double *shape, double alpha) {
    const double scale = largest_level(search);
    return (stop_density_t){.alpha_um_per_v2 = alpha,
                            .beta_per_v2 = exp(4.0 * shape[LOG_BETA]) / (scale * scale),
                            .delta_v = shape[DELTA] * scale,
                            .a = shape[TOP] - shape[INTERCEPT],
                            .b_v = shape[INTERCEPT] * scale,
                            .levels = search->levels,
                            .level_v = search->level_v};
}

static bool solve_small(search_t *search, double x[SMALL]) {
    const double lower[SMALL] = {-HUGE_VAL, search->least_direct, 0.0};
    return solve_bounded(&search->small, lower, x, NULL, search->failure);
}

/* The columns of the small problem as combinations of the fine ones, hence its products from theirs. */
static void project(search_t *search, const stop_density_t *density) {
    const double scale = largest_level(search);
    const normal_equations_t *fine = &search->fine;
    normal_equations_t *small = &search->small;
    double product[COLUMNS];
    stop_density_bank(density, search->threshold_v, search->weight);
    memset(search->column, 0, COLUMNS * sizeof(double));
    for (size_t j = 0; j < search->levels; j++) {
        const double place = fmin(search->threshold_v[j] / scale * FINE, FINE);
        const size_t node = place < FINE ? (size_t)place : FINE - 1;
        search->column[NODE + node] += search->weight[j] * ((double)node + 1.0 - place);
        search->column[NODE + node + 1] += search->weight[j] * (place - (double)node);
    }
    for (size_t i = 0; i < COLUMNS; i++) {
        product[i] = 0.0;
        for (size_t j = 0; j < COLUMNS; j++) {
            product[i] += fine->gram[i * COLUMNS + j] * search->column[j];
        }
    }
    double *gram = small->gram;
    for (size_t i = 0; i < SMALL_DENSITY; i++) { /* OFFSET and NODE are the first two here too */
        for (size_t j = 0; j < SMALL_DENSITY; j++) {
            gram[i * SMALL + j] = fine->gram[i * COLUMNS + j];
        }
        gram[i * SMALL + SMALL_DENSITY] = gram[SMALL_DENSITY * SMALL + i] = product[i];
        small->moment[i] = fine->moment[i];
    }
    gram[SMALL_DENSITY * SMALL + SMALL_DENSITY] = small->moment[SMALL_DENSITY] = 0.0;
    for (size_t i = 0; i < COLUMNS; i++) {
        gram[SMALL_DENSITY * SMALL + SMALL_DENSITY] += search->column[i] * product[i];
        small->moment[SMALL_DENSITY] += search->column[i] * fine->moment[i];
    }
    small->power = fine->power;
    small->rows = fine->rows;
}

/* Moves a trial inside of the bounds. Returns the square of how far it was outside. */
static double enter_bounds(const double *trial, double shape[SHAPE]) {
    double outside = 0.0;
    for (size_t i = 0; i < SHAPE; i++) {
        shape[i] = fmax(shape_low[i], fmin(shape_high[i], trial[i]));
        outside += (trial[i] - shape[i]) * (trial[i] - shape[i]);
    }
    shape[TOP] = fmax(shape[TOP], shape[INTERCEPT] + 0.1);
    return outside;
}

/* Sum of squares of the best density of this shape. Outside of the bounds: that on the bound, and more. */
static double cost(const double *trial, void *context) {
    search_t *search = context;
    double shape[SHAPE], x[SMALL];
    const double outside = enter_bounds(trial, shape);
    const stop_density_t density = make_density(search, shape, 1.0);
    project(search, &density);
    return solve_small(search, x) ? squared_error(&search->small, x) * (1.0 + outside) : HUGE_VAL;
}

static void search_grid(search_t *search, double best[SHAPE]) {
    static const int count[SHAPE] = {11, 7, 2, 3};
    static const double first[SHAPE] = {-1.25, -0.5, 0.0, 0.6}, step[SHAPE] = {0.25, 0.25, 0.1, 0.2};
    double least = HUGE_VAL;
    for (int number = 0; number < count[0] * count[1] * count[2] * count[3]; number++) {
        double trial[SHAPE];
        int rest = number;
        for (size_t i = 0; i < SHAPE; i++) {
            trial[i] = first[i] + step[i] * (rest % count[i]);
            rest /= count[i];
        }
        const double now = cost(trial, search);
        if (now < least) {
            least = now;
            memcpy(best, trial, sizeof trial);
        }
    }
}

static void search_shape(search_t *search, double shape[SHAPE]) {
    enum { RESTARTS = 3 };
    const simplex_job_t simplex = {
        .function = cost, .context = search, .dimensions = SHAPE, .step = 0.1, .size = 1e-6, .most_iterations = 300};
    double best[SHAPE] = {0};
    search_grid(search, best);
    for (int restart = 0; restart < RESTARTS; restart++) { /* a simplex may collapse on a bound */
        simplex_minimise(&simplex, best);
        progress_update(search->job->progress, (restart + 1.0) / (RESTARTS + 1.0));
    }
    enter_bounds(best, shape);
}

/* Whether the recording is explained as well with this part of the shape at a bound. */
static bool is_open(search_t *search, const double *shape, size_t part, double bound) {
    double error[2], moved[SHAPE], x[SMALL];
    memcpy(moved, shape, sizeof moved);
    moved[part] = bound;
    for (size_t trial = 0; trial < 2; trial++) {
        const stop_density_t density = make_density(search, trial == 0 ? shape : moved, 1.0);
        project(search, &density);
        if (!solve_small(search, x)) {
            return false;
        }
        error[trial] = squared_error(&search->small, x);
    }
    return error[1] <= as_good * as_good * error[0];
}

static void make_model(const search_t *search, const stop_density_t *density, const double x[SMALL], model_t *model) {
    const play_basis_t basis = {.operators = search->levels, .threshold_v = search->threshold_v};
    const double weights = stop_density_bank(density, search->threshold_v, search->weight);
    const double offset = x[SMALL_OFFSET] - center_v(search) * (x[SMALL_DIRECT] + weights);
    model_create(model, recordings_fastest_hz(search->job->recordings, search->job->count));
    model_block_t *block = model_append(model, &block_stop_density);
    model_set(block, "offset_um", offset);
    model_set(block, "gain_um_per_v", x[SMALL_DIRECT] + weights);
    model_set(block, "alpha_um_per_v2", density->alpha_um_per_v2);
    model_set(block, "beta_per_v2", density->beta_per_v2);
    model_set(block, "delta_v", density->delta_v);
    model_set(block, "a", density->a);
    model_set(block, "b_v", density->b_v);
    model_set_array(block, "levels_v", search->levels, search->level_v, NULL);
    if (search->job->count == 1) {
        const recording_t *recording = &search->job->recordings[0];
        linear_fit_t fit = {
            .operators = search->levels, .offset_um = offset, .weight = allocate(search->levels + 1, sizeof(double))};
        double *memory_v = allocate(search->levels, sizeof(double));
        fit.weight[0] = x[SMALL_DIRECT];
        memcpy(fit.weight + 1, search->weight, search->levels * sizeof(double));
        estimate_initial_memory(&basis, &fit, recording,
                                play_memory_determined(&basis, recording, search->job->train_to[0]), memory_v);
        model_set_array(block, "initial_memory_v", search->levels, memory_v, NULL);
        free(memory_v);
        linear_fit_free(&fit);
    }
    model->fit = json_pack("{s:I}", "operators", (json_int_t)search->levels);
}

/* Exact plays in place of the interpolated ones. */
static bool solve_exactly(search_t *search, stop_density_t *density, double x[SMALL]) {
    const play_basis_t basis = {.operators = search->levels, .threshold_v = search->threshold_v};
    stop_density_bank(density, search->threshold_v, search->weight);
    normal_equations_free(&search->small);
    normal_equations_create(&search->small, SMALL);
    add_samples(search, &basis, &search->small, fill_small);
    if (!solve_small(search, x)) {
        return false;
    }
    density->alpha_um_per_v2 = x[SMALL_DENSITY];
    return true;
}

static void say_what_is_open(search_t *search, const double *shape, const stop_density_t *density,
                             family_notes_t *notes) {
    if (!(density->alpha_um_per_v2 > 0.0)) {
        family_note(notes, "no hysteresis found: beta_per_v2, delta_v, a and b_v are not determined");
        return;
    }
    if (is_open(search, shape, LOG_BETA, shape_low[LOG_BETA])) {
        family_note(notes, "beta_per_v2 and delta_v are not determined: a flat density is as good");
    } else if (shape[DELTA] <= shape_low[DELTA] || shape[DELTA] >= shape_high[DELTA]) {
        family_note(notes, "alpha_um_per_v2, beta_per_v2 and delta_v are not determined one by one: over these "
                           "thresholds the density is as good as an exponential, and delta_v rests on its bound");
    }
    if (is_open(search, shape, TOP, shape_high[TOP])) {
        family_note(notes,
                    "a is not determined from above: the thresholds reach the largest that moves in this recording");
    }
    family_note(notes, "levels_v is a choice, even steps to half the drive range; a and b_v are relative to it");
}

static bool run(search_t *search, model_t *model, family_notes_t *notes) {
    play_basis_t basis = make_basis(FINE, largest_level(search));
    double shape[SHAPE], x[SMALL];
    add_samples(search, &basis, &search->fine, fill_fine);
    free(basis.threshold_v);
    search_shape(search, shape);
    stop_density_t density = make_density(search, shape, 1.0);
    if (!solve_exactly(search, &density, x)) {
        return false;
    }
    make_model(search, &density, x, model);
    say_what_is_open(search, shape, &density, notes);
    return true;
}

static bool fit(const family_job_t *job, model_t *model, family_notes_t *notes, failure_t *failure) {
    search_t search = {.job = job, .failure = failure};
    if (!measure_ranges(&search)) {
        return false;
    }
    search.column = allocate(COLUMNS, sizeof(double));
    search.threshold_v = allocate(search.levels, sizeof(double));
    search.weight = allocate(search.levels, sizeof(double));
    normal_equations_create(&search.fine, COLUMNS);
    normal_equations_create(&search.small, SMALL);
    const bool good = run(&search, model, notes);
    normal_equations_free(&search.fine);
    normal_equations_free(&search.small);
    free(search.column);
    free(search.threshold_v);
    free(search.weight);
    free(search.level_v);
    return good;
}

const family_t family_stop_density = {
    .name = "stop_density",
    .order = 30,
    .text = "stops weighted by alpha exp(-beta (r - delta)^2): seven numbers, for symmetric loops",
    .fit = fit};
