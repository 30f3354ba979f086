/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Family `bouc_wen`: Bouc-Wen hysteresis alone, on any drive. docs/MODELS.md, section 8.3.
 *
 *     y = offset + d u + s h[u; beta, gamma, n],      s <= 0,      d + s (dh/du) >= least slope on every branch
 *
 * For given beta, gamma and n the position is linear in the rest. With f the steepest dh/du and q = d + s f the columns
 * are u and f u - h, and both bounds are bounds on single unknowns, q and -s. beta, gamma and n are searched with a
 * simplex, on decimated samples: the model is rate-independent, so only rows are lost.
 */
#include "elements/bouc_wen.h"
#include "base/parallel.h"
#include "chain/catalogue.h"
#include "identify/family.h"
#include "numerics/least_squares.h"
#include "numerics/simplex.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { BETA, RATIO, EXPONENT, SHAPES };
enum { OFFSET, FLATTEST, RETARD, COLUMNS }; /* y = OFFSET + FLATTEST u + RETARD (f u - h) */
enum { SEARCH_ROWS = 3000, FINAL_ROWS = 20000, MOST_ITERATIONS = 200 };

/* Of the mean slope: what the flattest branch has at least. The drive of the inverse moves by as much more. */
static const double least_slope = 0.1;

typedef struct {
    const family_job_t *job;
    double center_v, half_range_v, least;
    size_t *from;   /**< first sample that counts, one a recording: from there on it matters little what was before */
    size_t samples; /**< of the training parts */
    size_t stride;  /**< every so many of them make a row */
    double x[COLUMNS];
    bool bound[COLUMNS];
    failure_t *failure;
} search_t;

static bouc_wen_t model_of(const double *shape) {
    bouc_wen_t model;
    const double beta = exp(fmax(-5.0, fmin(5.0, shape[BETA])));
    bouc_wen_open(&model, beta, beta * tanh(shape[RATIO]), 4.0 + 3.0 * tanh(shape[EXPONENT])); /* 1 < n < 7 */
    return model;
}

/* The largest dh/du there is: just after a reversal at the largest h that one movement across the range makes. */
static double steepest(const bouc_wen_t *model) {
    bouc_wen_t walker = *model;
    const double end = bouc_wen_step(&walker, 2.0);
    return 1.0 + fmax(0.0, model->beta - model->gamma) * pow(end, model->exponent);
}

static double input(const search_t *search, const recording_t *recording, size_t k) {
    return (recording->column[COLUMN_DRIVE][k] - search->center_v) / search->half_range_v;
}

static void add_recording(const search_t *search, size_t index, const bouc_wen_t *start,
                          normal_equations_t *equations) {
    const recording_t *recording = &search->job->recordings[index];
    const size_t to = search->job->train_to[index];
    const double f = steepest(start);
    bouc_wen_t model = *start;
    double before = input(search, recording, 0), here = before;
    (void)bouc_wen_settle(&model, here);
    for (size_t k = 1; k < to; k++) {
        const double next = input(search, recording, k);
        const bool row = k % search->stride == 0;
        if (row || (next - here) * (here - before) < 0.0) { /* what is passed over is one movement */
            if (!row) {
                (void)bouc_wen_step(&model, here);
            } else {
                const double h = bouc_wen_step(&model, next);
                const double column[COLUMNS] = {1.0, next, f * next - h};
                if (k >= search->from[index]) {
                    normal_equations_add(equations, column, recording->column[COLUMN_DISPLACEMENT][k]);
                }
            }
        }
        before = here;
        here = next;
    }
}

/* The best x for these shapes. Returns the squared error, HUGE_VAL on failure. */
static double error_of(const double *shape, void *context) {
    search_t *search = context;
    const bouc_wen_t model = model_of(shape);
    const double lower[COLUMNS] = {-HUGE_VAL, search->least, 0.0};
    normal_equations_t equations;
    double error = HUGE_VAL;
    normal_equations_create(&equations, COLUMNS);
    for (size_t i = 0; i < search->job->count; i++) {
        add_recording(search, i, &model, &equations);
    }
    normal_equations_finish(&equations);
    if (solve_bounded(&equations, lower, search->x, search->bound, search->failure)) {
        error = squared_error(&equations, search->x);
    }
    normal_equations_free(&equations);
    return error;
}

/* The first sample behind which the drive has been at both ends of its training part's range, to a twentieth. */
static size_t swept_from(const double *drive, size_t to, double *low, double *high) {
    bool bottom = false, top = false;
    *low = *high = drive[0];
    for (size_t k = 1; k < to; k++) {
        *low = fmin(*low, drive[k]);
        *high = fmax(*high, drive[k]);
    }
    for (size_t k = 0; k < to; k++) {
        const double part = (drive[k] - *low) / (*high - *low);
        bottom = bottom || part < 0.05;
        top = top || part > 0.95;
        if (bottom && top) {
            return k < to / 2 ? k : 0;
        }
    }
    return 0;
}

static void prepare(search_t *search) {
    const family_job_t *job = search->job;
    double low = HUGE_VAL, high = -HUGE_VAL, least_um = HUGE_VAL, most_um = -HUGE_VAL;
    for (size_t i = 0; i < job->count; i++) {
        double least, most;
        search->from[i] = swept_from(job->recordings[i].column[COLUMN_DRIVE], job->train_to[i], &least, &most);
        low = fmin(low, least);
        high = fmax(high, most);
        for (size_t k = 0; k < job->train_to[i]; k++) {
            least_um = fmin(least_um, job->recordings[i].column[COLUMN_DISPLACEMENT][k]);
            most_um = fmax(most_um, job->recordings[i].column[COLUMN_DISPLACEMENT][k]);
        }
        search->samples += job->train_to[i];
    }
    search->center_v = 0.5 * (low + high);
    search->half_range_v = 0.5 * (high - low);
    search->least = least_slope * 0.5 * (most_um - least_um);
}

/* From there, with about so many rows. */
static double descend(search_t *search, size_t rows, double step, double shape[SHAPES]) {
    const simplex_job_t job = {.function = error_of,
                               .context = search,
                               .dimensions = SHAPES,
                               .step = step,
                               .size = 1e-4,
                               .most_iterations = MOST_ITERATIONS};
    search->stride = 1 + search->samples / rows;
    return simplex_minimise(&job, shape);
}

/* Loops that saturate late, in the middle of the range and early; round and sharp ones. */
static const double starts[][SHAPES] = {{-0.7, 0.0, -1.0}, {0.7, 0.0, -1.0}, {1.8, 0.0, -1.0}, {0.0, 0.5, -0.2}};
enum { STARTS = sizeof starts / sizeof starts[0] };

typedef struct {
    search_t search;
    failure_t refusal; /* of one pair of numbers; others follow */
    double shape[SHAPES], error;
} descent_t;

static void descend_from(void *context, size_t index) {
    descent_t *descent = (descent_t *)context + index;
    descent->search.failure = &descent->refusal;
    memcpy(descent->shape, starts[index], sizeof descent->shape);
    descent->error = descend(&descent->search, SEARCH_ROWS, 0.4, descent->shape);
}

static void search_shapes(search_t *search, double best[SHAPES]) {
    descent_t descent[STARTS];
    size_t least = 0;
    for (size_t i = 0; i < STARTS; i++) {
        descent[i].search = *search;
    }
    parallel(STARTS, descend_from, descent);
    for (size_t i = 1; i < STARTS; i++) {
        least = descent[i].error < descent[least].error ? i : least;
    }
    memcpy(best, descent[least].shape, sizeof descent[least].shape);
    progress_update(search->job->progress, 0.9);
    (void)descend(search, FINAL_ROWS, 0.02, best);
}

static void make_model(const search_t *search, const double *shape, model_t *model) {
    const bouc_wen_t found = model_of(shape);
    model_create(model, recordings_fastest_hz(search->job->recordings, search->job->count));
    model_block_t *block = model_append(model, &block_bouc_wen);
    model_set(block, "center_v", search->center_v);
    model_set(block, "half_range_v", search->half_range_v);
    model_set(block, "offset_um", search->x[OFFSET]);
    model_set(block, "direct_um", search->x[FLATTEST] + steepest(&found) * search->x[RETARD]);
    model_set(block, "hysteretic_um", -search->x[RETARD]);
    model_set(block, "beta", found.beta);
    model_set(block, "gamma", found.gamma);
    model_set(block, "exponent", found.exponent);
}

static bool fit(const family_job_t *job, model_t *model, family_notes_t *notes, failure_t *failure) {
    search_t search = {.job = job, .from = allocate(job->count, sizeof *search.from), .failure = failure};
    double shape[SHAPES];
    prepare(&search);
    search_shapes(&search, shape);
    search.stride = 1;
    const bool good = isfinite(error_of(shape, &search));
    if (good) {
        make_model(&search, shape, model);
        if (search.bound[FLATTEST]) {
            family_note(notes, "the flattest branch is held at %g of the mean slope: the inverse needs it to rise",
                        least_slope);
        }
    }
    free(search.from);
    return good;
}

const family_t family_bouc_wen = {
    .name = "bouc_wen", .order = 80, .text = "Bouc-Wen hysteresis alone, rate-independent; any drive", .fit = fit};
