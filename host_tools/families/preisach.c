/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Preisach model: the table by least squares, from first-order reversal curves or any other drive. docs/MODELS.md,
 * section 7.
 *
 * The levels divide the range of the training drives evenly. Their number and the smoothness are chosen inside the
 * training data: fitted on its first two thirds, judged on its last third; the fewest levels within 1 % of the best
 * win. Samples whose memory still depends on what happened before the recording do not take part; the past is then
 * estimated from them. If they are most of the training data, past and table are estimated in turn, starting from
 * demagnetised.
 */
#include "catalogue.h"
#include "family.h"
#include "preisach_fit.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_INTERVALS = 60, MOST_CANDIDATES = 32 };

/* Of the training data; below it the past is estimated along with the table. */
static const double least_determined_part = 0.25;
static const double training_part = 2.0 / 3.0;
/* Times the best validation error: fewer levels win. */
static const double good_enough = 1.01;
/* Slope of the triangles, of the mean slope, as for play operators (prandtl_ishlinskii.c): without it the drive of the
 * inverse jumps at every turning point. On the real recordings it costs 0.01 % NRMSE. */
static const double least_slope_part = 0.3;
/* Of the drive's range: so close to an end of the levels counts as there. Recorded peaks differ by noise and sampling.
 */
static const double reached_part = 0.005;
/* Samples that are enough to tell one grid from another. */
static const size_t structure_rows = 6000;

typedef struct {
    size_t intervals;
    double smoothing, validation_nrmse_percent;
} candidate_t;

typedef struct {
    const family_job_t *job;
    failure_t *failure;
    double low_v, high_v;
    double mean_slope;
    preisach_span_t *train; /* one a recording */
    size_t candidates;
    candidate_t candidate[MOST_CANDIDATES];
    candidate_t chosen;
    bool from_demagnetised;
} preisach_job_t;

static void range_of(const double *values, size_t count, double *low, double *high) {
    *low = *high = values[0];
    for (size_t k = 1; k < count; k++) {
        *low = fmin(*low, values[k]);
        *high = fmax(*high, values[k]);
    }
}

/*
 * The first sample from which on the past no longer matters: the drive has been at both ends of its own range. (At one
 * end relays that switch beyond it may still be waiting for their first and last switch.) In a recording that reaches
 * neither end of the levels the relays that then never move again leave an unknown constant.
 */
static void set_determined(const preisach_job_t *job, preisach_span_t *span) {
    const double *drive = span->recording->column[COLUMN_DRIVE], near_v = reached_part * (job->high_v - job->low_v);
    double low, high;
    bool at_low = false, at_high = false;
    range_of(drive, span->to, &low, &high);
    span->own_offset = low > job->low_v + near_v && high < job->high_v - near_v;
    span->from = 0;
    while (span->from < span->to && !(at_low && at_high)) {
        at_low = at_low || drive[span->from] <= low + near_v;
        at_high = at_high || drive[span->from] >= high - near_v;
        span->from++;
    }
}

static bool prepare(preisach_job_t *job) {
    const family_job_t *family_job = job->job;
    size_t used = 0, all = 0;
    job->low_v = HUGE_VAL;
    job->high_v = -HUGE_VAL;
    for (size_t s = 0; s < family_job->count; s++) {
        const recording_t *recording = &family_job->recordings[s];
        double low, high;
        range_of(recording->column[COLUMN_DRIVE], family_job->train_to[s], &low, &high);
        job->low_v = fmin(job->low_v, low);
        job->high_v = fmax(job->high_v, high);
    }
    for (size_t s = 0; s < family_job->count; s++) {
        preisach_span_t *span = &job->train[s];
        const double *drive = family_job->recordings[s].column[COLUMN_DRIVE];
        const double *displacement = family_job->recordings[s].column[COLUMN_DISPLACEMENT];
        const size_t end = family_job->train_to[s];
        double cross = 0.0, square = 0.0;
        *span = (preisach_span_t){.recording = &family_job->recordings[s], .to = end};
        set_determined(job, span);
        used += end - span->from;
        all += end;
        for (size_t k = 1; k < end; k++) { /* regression through the first sample */
            cross += (drive[k] - drive[0]) * (displacement[k] - displacement[0]);
            square += (drive[k] - drive[0]) * (drive[k] - drive[0]);
        }
        if (!(cross > 0.0)) {
            return fail(job->failure,
                        "%s: the displacement falls where the drive rises: turn the sign of one of them before the fit",
                        span->recording->name);
        }
        job->mean_slope = fmax(job->mean_slope, cross / square);
    }
    job->from_demagnetised = (double)used < least_determined_part * (double)all;
    for (size_t s = 0; s < family_job->count && job->from_demagnetised; s++) {
        job->train[s].from = 0;
    }
    return true;
}

/* Even levels over the range of the training drives, to be freed. */
static preisach_grid_t make_grid(const preisach_job_t *job, size_t intervals) {
    double *level_v = allocate(intervals + 1, sizeof(double));
    for (size_t i = 0; i <= intervals; i++) {
        level_v[i] = job->low_v + (job->high_v - job->low_v) * (double)i / (double)intervals;
    }
    return (preisach_grid_t){.levels = intervals + 1, .level_v = level_v};
}

static void free_grid(preisach_grid_t *grid) {
    free((double *)grid->level_v);
}

static preisach_options_t options_of(const preisach_job_t *job, double smoothing, size_t most_rows) {
    return (preisach_options_t){
        .smoothing = smoothing, .least_slope = least_slope_part * job->mean_slope, .most_rows = most_rows};
}

/* Fitted on the first two thirds of the training data, judged on its last third: worst NRMSE. */
static bool validate(const preisach_job_t *job, candidate_t *candidate) {
    const size_t count = job->job->count;
    const preisach_options_t options = options_of(job, candidate->smoothing, structure_rows);
    preisach_grid_t grid = make_grid(job, candidate->intervals);
    preisach_span_t *inner = allocate(count, sizeof *inner);
    preisach_fit_t fit;
    bool good;
    for (size_t s = 0; s < count; s++) {
        inner[s] = job->train[s];
        inner[s].to = inner[s].from + (size_t)(training_part * (double)(inner[s].to - inner[s].from));
    }
    good = preisach_fit(&grid, inner, count, &options, &fit, job->failure);
    for (size_t s = 0; good && s < count; s++) {
        const preisach_span_t *whole = &job->train[s];
        const double *measured = whole->recording->column[COLUMN_DISPLACEMENT] + inner[s].to;
        const size_t judged = whole->to - inner[s].to;
        double *position = allocate(whole->to, sizeof(double)), low, high, mean = 0.0, squares = 0.0;
        preisach_predict(&grid, &fit, whole, position);
        for (size_t k = 0; k < judged && whole->own_offset; k++) {
            mean += (measured[k] - position[inner[s].to + k]) / (double)judged;
        }
        for (size_t k = 0; k < judged; k++) {
            const double error = measured[k] - position[inner[s].to + k] - mean;
            squares += error * error / (double)judged;
        }
        if (judged > 0) {
            range_of(measured, judged, &low, &high);
            if (high > low) { /* a part without motion judges nothing */
                candidate->validation_nrmse_percent =
                    fmax(candidate->validation_nrmse_percent, 100.0 * sqrt(squares) / (high - low));
            }
        }
        free(position);
    }
    if (good) {
        preisach_fit_free(&fit);
    }
    free_grid(&grid);
    free(inner);
    return good;
}

static bool choose_structure(preisach_job_t *job) {
    static const size_t numbers[] = {4, 6, 8, 10, 13, 16, 20, 25, 30}; /* an amplifier holds 30 */
    static const double smoothings[] = {1e-6, 1e-4, 1e-2};
    enum { NUMBERS = sizeof numbers / sizeof numbers[0], SMOOTHINGS = sizeof smoothings / sizeof smoothings[0] };
    const bool given = job->job->operators > 0;
    const size_t rows = given ? 1 : NUMBERS;
    double best = HUGE_VAL;
    for (size_t i = 0; i < rows * SMOOTHINGS; i++) {
        candidate_t *candidate = &job->candidate[job->candidates++];
        const size_t wanted = given ? job->job->operators : numbers[i / SMOOTHINGS];
        *candidate = (candidate_t){.intervals = wanted < MOST_INTERVALS ? wanted : MOST_INTERVALS,
                                   .smoothing = smoothings[i % SMOOTHINGS]};
        if (!validate(job, candidate)) {
            return false;
        }
        best = fmin(best, candidate->validation_nrmse_percent);
        progress_update(job->job->progress, (double)job->candidates / (double)(rows * SMOOTHINGS));
    }
    for (size_t i = 0; i < job->candidates; i++) {
        const candidate_t *candidate = &job->candidate[i];
        if (candidate->validation_nrmse_percent <= good_enough * best &&
            (job->chosen.intervals == 0 ||
             (candidate->intervals == job->chosen.intervals &&
              candidate->validation_nrmse_percent < job->chosen.validation_nrmse_percent))) {
            job->chosen = *candidate;
        }
    }
    return true;
}

/* The samples [0, end) that a past is judged by, and what the model makes of them. */
typedef struct {
    const preisach_grid_t *grid;
    const preisach_fit_t *fit;
    const preisach_span_t *span;
    size_t end, stride;
} past_search_t;

static double past_error(const past_search_t *search, const double past_v[PREISACH_PAST], bool has_past) {
    preisach_span_t span = *search->span;
    preisach_memory_t memory;
    double sum = 0.0;
    span.has_past = has_past;
    memcpy(span.past_v, past_v, sizeof span.past_v);
    preisach_span_begin(search->grid, &span, &memory);
    for (size_t k = 0; k < search->end; k++) {
        preisach_memory_move(&memory, search->grid, span.recording->column[COLUMN_DRIVE][k]);
        if (k % search->stride == 0) {
            sum += fabs(span.recording->column[COLUMN_DISPLACEMENT][k] -
                        preisach_output(search->grid, search->fit->everett_um, search->fit->offset_um, &memory));
        }
    }
    return sum;
}

/*
 * The past that explains the samples before span->from best (least sum of absolute errors): demagnetised, or three
 * drives from the lowest level on, found on a grid and then in ever smaller steps.
 */
static void estimate_past(const preisach_job_t *job, const preisach_grid_t *grid, const preisach_fit_t *fit,
                          preisach_span_t *span, size_t end) {
    enum { GRID = 8, MOST_SAMPLES = 300, ROUNDS = 14 };
    const past_search_t search = {grid, fit, span, end > 0 ? end : 1, end / MOST_SAMPLES + 1};
    const double width = job->high_v - job->low_v;
    double past[PREISACH_PAST] = {job->low_v, job->low_v, job->low_v}, best[PREISACH_PAST], step = width / (2 * GRID);
    double least = past_error(&search, past, true);
    memcpy(best, past, sizeof best);
    for (size_t k = 0; k < GRID * GRID * GRID; k++) {
        const size_t place[PREISACH_PAST] = {k / (GRID * GRID), k / GRID % GRID, k % GRID};
        double error;
        for (size_t p = 0; p < PREISACH_PAST; p++) {
            past[p] = job->low_v + width * (double)place[p] / (GRID - 1);
        }
        error = past_error(&search, past, true);
        if (error < least) {
            least = error;
            memcpy(best, past, sizeof best);
        }
    }
    for (size_t k = 0; k < ROUNDS * PREISACH_PAST * 2; k++) {
        double error;
        memcpy(past, best, sizeof past);
        past[k / 2 % PREISACH_PAST] += k % 2 == 0 ? step : -step;
        error = past_error(&search, past, true);
        if (error < least) {
            least = error;
            memcpy(best, past, sizeof best);
        }
        if (k % (PREISACH_PAST * 2) == PREISACH_PAST * 2 - 1) {
            step *= 0.6;
        }
    }
    span->has_past = least < past_error(&search, best, false);
    memcpy(span->past_v, best, sizeof span->past_v);
}

static void estimate_pasts(preisach_job_t *job, const preisach_grid_t *grid, const preisach_fit_t *fit) {
    for (size_t s = 0; s < job->job->count; s++) {
        preisach_span_t measured = job->train[s];
        if (!measured.own_offset) { /* else the position is only known up to a constant */
            set_determined(job, &measured);
            estimate_past(job, grid, fit, &job->train[s], measured.from);
        }
    }
}

static bool fit_structure(preisach_job_t *job, const preisach_grid_t *grid, preisach_fit_t *fit) {
    const preisach_options_t options = options_of(job, job->chosen.smoothing, 0);
    if (!preisach_fit(grid, job->train, job->job->count, &options, fit, job->failure)) {
        return false;
    }
    for (int round = 0; round < 3 && job->from_demagnetised; round++) {
        estimate_pasts(job, grid, fit);
        preisach_fit_free(fit);
        if (!preisach_fit(grid, job->train, job->job->count, &options, fit, job->failure)) {
            return false;
        }
    }
    estimate_pasts(job, grid, fit);
    return preisach_fit_sigma(grid, job->train, job->job->count, &options, fit, job->failure);
}

static void take_notes(const preisach_job_t *job, const preisach_fit_t *fit, family_notes_t *notes) {
    if (job->job->operators > 0) {
        family_note(notes, "intervals %zu: %s", job->chosen.intervals,
                    job->job->operators > MOST_INTERVALS ? "the most there may be" : "as asked for");
    } else {
        family_note(notes,
                    "intervals %zu: the fewest within 1 %% of the best validation error, fitted and judged inside the "
                    "training data:",
                    job->chosen.intervals);
    }
    for (size_t i = 0; i < job->candidates; i++) {
        if (job->candidate[i].smoothing == job->chosen.smoothing) {
            family_note(notes, "  %3zu intervals: %.4f %%", job->candidate[i].intervals,
                        job->candidate[i].validation_nrmse_percent);
        }
    }
    if (fit->determined < fit->elements) {
        family_note(
            notes,
            "%zu of %zu elements of everett_um are not determined by the recording (standard error above 5 %% of "
            "the range):",
            fit->elements - fit->determined, fit->elements);
        family_note(notes,
                    "  there smoothness with weight %.0e decides; first-order reversal curves would determine "
                    "them",
                    job->chosen.smoothing);
    }
    family_note(notes,
                "standard errors (+-) count %.0f neighbouring samples as one: the residuals are that long correlated",
                fit->autocorrelation_samples);
    if (job->job->creep) {
        family_note(notes, "creep: not looked for by this family");
    }
    if (job->job->count == 1) {
        family_note(notes, "past_v estimated from the samples that still depend on it");
    }
    if (job->from_demagnetised) {
        family_note(notes,
                    "the drive never erases the past: estimated along with the table, starting from demagnetised");
    }
}

static json_t *facts(const preisach_job_t *job, const preisach_fit_t *fit) {
    json_t *candidates = json_array();
    for (size_t i = 0; i < job->candidates; i++) {
        json_array_append_new(candidates,
                              json_pack("{s:I, s:f, s:f}", "operators", (json_int_t)job->candidate[i].intervals,
                                        "smoothing", job->candidate[i].smoothing, "validation_nrmse_percent",
                                        job->candidate[i].validation_nrmse_percent));
    }
    return json_pack("{s:I, s:f, s:f, s:I, s:f, s:o}", "operators", (json_int_t)job->chosen.intervals,
                     "residual_rms_um", fit->rms_um, "smoothing", job->chosen.smoothing, "determined_elements",
                     (json_int_t)fit->determined, "residual_autocorrelation_samples", fit->autocorrelation_samples,
                     "candidates", candidates);
}

static void make_model(const preisach_job_t *job, const preisach_grid_t *grid, const preisach_fit_t *fit,
                       model_t *model) {
    model_block_t *block;
    model_create(model, job->job->recordings[0].sample_rate_hz);
    block = model_append(model, &block_preisach);
    model_set_array(block, "levels_v", grid->levels, grid->level_v, NULL);
    model_set_array(block, "everett_um", fit->elements, fit->everett_um, fit->sigma_um);
    model_set_array(block, "offset_um", 1, &fit->offset_um, &fit->offset_sigma_um);
    if (job->job->count == 1 && job->train[0].has_past) {
        model_set_array(block, "past_v", PREISACH_PAST, job->train[0].past_v, NULL);
    }
    model->fit = facts(job, fit);
}

static bool fit_prepared(preisach_job_t *job, model_t *model, family_notes_t *notes) {
    preisach_grid_t grid;
    preisach_fit_t fit = {0};
    bool good;
    if (!prepare(job) || !choose_structure(job)) {
        return false;
    }
    grid = make_grid(job, job->chosen.intervals);
    good = fit_structure(job, &grid, &fit);
    if (good) {
        make_model(job, &grid, &fit, model);
        take_notes(job, &fit, notes);
    }
    preisach_fit_free(&fit);
    free_grid(&grid);
    return good;
}

static bool fit(const family_job_t *family_job, model_t *model, family_notes_t *notes, failure_t *failure) {
    preisach_job_t job = {
        .job = family_job, .failure = failure, .train = allocate(family_job->count, sizeof *job.train)};
    const bool good = fit_prepared(&job, model, notes);
    free(job.train);
    return good;
}

const family_t family_preisach = {
    .name = "preisach",
    .text = "relays over the plane of their switching drives; first-order reversal curves, or any drive with many "
            "reversals",
    .fit = fit};
