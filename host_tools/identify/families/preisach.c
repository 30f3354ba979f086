/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Preisach model: the table by least squares, from first-order reversal curves or any other drive. docs/MODELS.md,
 * section 7.
 *
 * The levels divide the range of the training drives like those of the amplifier that is compiled from the model. Their
 * number is chosen by validation inside the training data: fitted to its first two thirds, validated on its last third.
 * The smallest number within 1 % of the best is chosen.
 *
 * Samples whose memory still depends on the drive before the recording are excluded; the past is estimated from them
 * afterwards. If they are most of the training data, past and table are estimated alternately, starting from
 * demagnetised.
 */
#include "chain/catalogue.h"
#include "identify/creep_search.h"
#include "identify/families/bank_job.h"
#include "identify/preisach_past.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_INTERVALS = 60, MOST_CANDIDATES = 10 };

/* Of the training data; below it the past is estimated along with the table. */
static const double least_determined_part = 0.25;
static const double training_part = 2.0 / 3.0;
/* Times the best validation error: fewer levels win. */
static const double good_enough = 1.01;
/* Weight of the smoothness penalty, relative to the data. It decides where the recording has no information, and biases
 * other elements by at most some 1e-5 of the range (tests/host/identify/test_fit_preisach.c). */
static const double smoothing = 1e-6;
/* Of the drive's range: so close to an end of the levels counts as there. Recorded peaks differ by noise and sampling.
 */
static const double reached_part = 0.001;
/* An amplifier's drive range is the recorded one, widened by this part on each side (compile.h). */
static const double margin_part = 0.025;
/* Samples that are enough to tell one grid from another. */
static const size_t structure_rows = 6000;

typedef struct {
    size_t intervals;
    double validation_nrmse_percent;
} candidate_t;

typedef struct {
    const family_job_t *job;
    failure_t *failure;
    double low_v, high_v;              /* of the training drives */
    bank_job_t bank;                   /* for what banks of plays share: the least slope, and creep */
    preisach_span_t *train;            /* one a recording */
    double (*past_v)[PREISACH_PAST];   /* estimated, likewise */
    double rest_v[2 * MOST_INTERVALS]; /* demagnetised within the range of the training drives, as a past */
    size_t candidates;
    candidate_t candidate[MOST_CANDIDATES];
    size_t intervals; /* chosen */
    bool both_ends;   /* it takes both ends of the range to erase the past */
    bool from_demagnetised;
} preisach_job_t;

/*
 * The first sample from which on the past no longer matters: the drive has been at both ends of its range. With
 * both_ends false, one end that is also one of the levels suffices, provided that the actuator never left the range
 * before. Otherwise relays that switch beyond the range may still be in an unknown state. In a recording that reaches
 * neither end of the levels, relays that never switch again add an unknown constant.
 */
static size_t determined_at(const preisach_job_t *job, preisach_span_t *span) {
    const double *drive = span->recording->column[COLUMN_DRIVE], near_v = reached_part * (job->high_v - job->low_v);
    double range[2];
    bool at_low = false, at_high = false;
    size_t k = 0;
    values_range(drive, span->to, range);
    span->own_offset = range[0] > job->low_v + near_v && range[1] < job->high_v - near_v;
    for (; k < span->to; k++) {
        at_low = at_low || drive[k] <= range[0] + near_v;
        at_high = at_high || drive[k] >= range[1] - near_v;
        if ((at_low && at_high) || (!job->both_ends && ((at_low && range[0] <= job->low_v + near_v) ||
                                                        (at_high && range[1] >= job->high_v - near_v)))) {
            return k;
        }
    }
    return k;
}

/* Returns whether a good part of the training samples does not depend on the past. */
static bool leave_out_undetermined(preisach_job_t *job, bool both_ends) {
    size_t used = 0, all = 0;
    job->both_ends = both_ends;
    for (size_t s = 0; s < job->job->count; s++) {
        job->train[s].from = determined_at(job, &job->train[s]);
        used += job->train[s].to - job->train[s].from;
        all += job->train[s].to;
    }
    return (double)used >= least_determined_part * (double)all;
}

static void prepare(preisach_job_t *job) {
    const family_job_t *family_job = job->job;
    job->low_v = HUGE_VAL;
    job->high_v = -HUGE_VAL;
    for (size_t s = 0; s < family_job->count; s++) {
        const recording_t *recording = &family_job->recordings[s];
        double range[2];
        values_range(recording->column[COLUMN_DRIVE], family_job->train_to[s], range);
        job->low_v = fmin(job->low_v, range[0]);
        job->high_v = fmax(job->high_v, range[1]);
    }
    for (size_t k = 0; k < MOST_INTERVALS; k++) {
        const double inset = (job->high_v - job->low_v) * (double)k / (2.0 * MOST_INTERVALS);
        job->rest_v[2 * k] = job->low_v + inset;
        job->rest_v[2 * k + 1] = job->high_v - inset;
    }
    for (size_t s = 0; s < family_job->count; s++) {
        job->train[s] = (preisach_span_t){.recording = &job->bank.recordings[s],
                                          .to = family_job->train_to[s],
                                          .past = 2 * MOST_INTERVALS,
                                          .past_v = job->rest_v};
    }
    job->from_demagnetised = !leave_out_undetermined(job, true) && !leave_out_undetermined(job, false);
    for (size_t s = 0; s < family_job->count && job->from_demagnetised; s++) {
        job->train[s].from = 0;
    }
}

/*
 * The levels of an amplifier with so many intervals, as far as they lie inside the range of the training drives, and
 * the two ends of that range. To be freed.
 */
static preisach_grid_t make_grid(const preisach_job_t *job, size_t intervals) {
    const double range_v = job->high_v - job->low_v;
    double *level_v = allocate(intervals + 1, sizeof(double));
    level_v[0] = job->low_v;
    for (size_t i = 1; i < intervals; i++) {
        level_v[i] = job->low_v + range_v * ((1.0 + 2.0 * margin_part) * (double)i / (double)intervals - margin_part);
    }
    level_v[intervals] = job->high_v;
    return (preisach_grid_t){.levels = intervals + 1, .level_v = level_v};
}

static void free_grid(preisach_grid_t *grid) {
    free((double *)grid->level_v);
}

static preisach_options_t options_of(const preisach_job_t *job, size_t most_rows) {
    return (preisach_options_t){
        .smoothing = smoothing, .least_slope = job->bank.linear.least_direct, .most_rows = most_rows};
}

/* Fitted on the first two thirds of the training data, judged on its last third: worst NRMSE. */
static bool validate(const preisach_job_t *job, candidate_t *candidate) {
    const size_t count = job->job->count;
    const preisach_options_t options = options_of(job, structure_rows);
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
        double *position = allocate(whole->to, sizeof(double)), range[2], mean = 0.0, squares = 0.0;
        preisach_predict(&grid, &fit, whole, position);
        for (size_t k = 0; k < judged && whole->own_offset; k++) {
            mean += (measured[k] - position[inner[s].to + k]) / (double)judged;
        }
        for (size_t k = 0; k < judged; k++) {
            const double error = measured[k] - position[inner[s].to + k] - mean;
            squares += error * error / (double)judged;
        }
        if (judged > 0) {
            values_range(measured, judged, range);
            if (range[1] > range[0]) { /* a part without motion judges nothing */
                candidate->validation_nrmse_percent =
                    fmax(candidate->validation_nrmse_percent, 100.0 * sqrt(squares) / (range[1] - range[0]));
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
    const bool given = job->job->operators > 0;
    const size_t count = given ? 1 : sizeof numbers / sizeof numbers[0];
    double best = HUGE_VAL;
    for (size_t i = 0; i < count; i++) {
        candidate_t *candidate = &job->candidate[job->candidates++];
        const size_t wanted = given ? job->job->operators : numbers[i];
        *candidate = (candidate_t){.intervals = wanted < MOST_INTERVALS ? wanted : MOST_INTERVALS};
        if (!validate(job, candidate)) {
            return false;
        }
        best = fmin(best, candidate->validation_nrmse_percent);
        progress_update(job->job->progress, (double)job->candidates / (double)count);
    }
    for (size_t i = job->candidates; i-- > 0;) {
        if (job->candidate[i].validation_nrmse_percent <= good_enough * best) {
            job->intervals = job->candidate[i].intervals;
        }
    }
    return true;
}

static void estimate_pasts(preisach_job_t *job, const preisach_grid_t *grid, const preisach_fit_t *fit) {
    for (size_t s = 0; s < job->job->count; s++) {
        preisach_span_t measured = job->train[s];
        if (!measured.own_offset) { /* else the position is only known up to a constant */
            const double range_v[] = {job->low_v, job->high_v};
            const size_t end = determined_at(job, &measured);
            if (preisach_find_past(grid, fit, &measured, end, range_v, job->past_v[s])) {
                job->train[s].past = PREISACH_PAST;
                job->train[s].past_v = job->past_v[s];
            }
        }
    }
}

static bool fit_structure(preisach_job_t *job, const preisach_grid_t *grid, preisach_fit_t *fit) {
    const preisach_options_t options = options_of(job, 0);
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
        family_note(notes, "intervals %zu: %s", job->intervals,
                    job->job->operators > MOST_INTERVALS ? "the maximum" : "as requested");
    } else {
        family_note(notes,
                    "intervals %zu: the fewest within 1 %% of the best validation error, fitted and judged inside the "
                    "training data:",
                    job->intervals);
    }
    for (size_t i = 0; i < job->candidates; i++) {
        family_note(notes, "  %3zu intervals: %.4f %%", job->candidate[i].intervals,
                    job->candidate[i].validation_nrmse_percent);
    }
    if (fit->determined < fit->elements) {
        family_note(
            notes,
            "%zu of %zu elements of everett_um are not determined by the recording (standard error above 5 %% of "
            "the range):",
            fit->elements - fit->determined, fit->elements);
        family_note(
            notes,
            "  there smoothness with weight %.0e decides; reversal curves would determine them, or ever smaller swings "
            "(hyst record --waveform triangle)",
            smoothing);
    }
    family_note(notes, "standard errors (+-) allow for a residual that is correlated over %.0f samples",
                fit->autocorrelation_samples);
    if (job->job->creep && !job->bank.creep) {
        family_note(notes, "creep: no minimum between -2 and 8 %% a decade, so these recordings do not determine it; "
                           "left out");
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
                              json_pack("{s:I, s:f}", "operators", (json_int_t)job->candidate[i].intervals,
                                        "validation_nrmse_percent", job->candidate[i].validation_nrmse_percent));
    }
    return json_pack("{s:I, s:f, s:f, s:I, s:f, s:o}", "operators", (json_int_t)job->intervals, "residual_rms_um",
                     fit->rms_um, "smoothing", smoothing, "determined_elements", (json_int_t)fit->determined,
                     "residual_autocorrelation_samples", fit->autocorrelation_samples, "candidates", candidates);
}

static void make_model(const preisach_job_t *job, const preisach_grid_t *grid, const preisach_fit_t *fit,
                       model_t *model) {
    model_block_t *block;
    model_create(model, recordings_fastest_hz(job->job->recordings, job->job->count));
    block = model_append(model, &block_preisach);
    model_set_array(block, "levels_v", grid->levels, grid->level_v, NULL);
    model_set_array(block, "everett_um", fit->elements, fit->everett_um, fit->sigma_um);
    model_set_array(block, "offset_um", 1, &fit->offset_um, &fit->offset_sigma_um);
    if (job->job->count == 1) {
        model_set_array(block, "past_v", job->train[0].past, job->train[0].past_v, NULL);
    } else { /* each has a separate past */
        model_set_array(block, "past_v", 2 * MOST_INTERVALS, job->rest_v, NULL);
    }
    if (job->bank.creep) {
        bank_append_creep(&job->bank, model);
    }
    model->fit = facts(job, fit);
}

/* Mean squared residual of the best table, on displacements with creep removed. */
typedef struct {
    const preisach_job_t *job;
    const preisach_grid_t *grid;
} creep_table_t;

static bool fit_without_creep(void *context, const recording_t *elastic, double *mean_square, size_t *samples) {
    const creep_table_t *table = context;
    const preisach_options_t options = options_of(table->job, 0);
    const size_t count = table->job->job->count;
    preisach_span_t *spans = allocate(count, sizeof *spans);
    preisach_fit_t fit;
    bool good;
    for (size_t s = 0; s < count; s++) {
        spans[s] = table->job->train[s];
        spans[s].recording = &elastic[s];
    }
    good = preisach_fit(table->grid, spans, count, &options, &fit, table->job->failure);
    if (good) {
        *mean_square = fit.rms_um * fit.rms_um;
        *samples = fit.rows;
        preisach_fit_free(&fit);
    }
    free(spans);
    return good;
}

/* Finds gamma with this many intervals, and removes creep from the displacement. */
static bool find_creep(preisach_job_t *job) {
    enum { CREEP_INTERVALS = 16 };
    const size_t count = job->job->count;
    preisach_grid_t grid = make_grid(job, CREEP_INTERVALS);
    creep_table_t table = {.job = job, .grid = &grid};
    const bool good = bank_find_creep(&job->bank, fit_without_creep, &table);
    free_grid(&grid);
    for (size_t s = 0; s < count; s++) {
        job->train[s].recording = &job->bank.recordings[s];
    }
    return good;
}

static bool fit_prepared(preisach_job_t *job, model_t *model, family_notes_t *notes) {
    preisach_grid_t grid;
    preisach_fit_t fit = {0};
    bool good;
    bank_prepare(&job->bank);
    prepare(job);
    if ((job->job->creep && !find_creep(job)) || !choose_structure(job)) {
        return false;
    }
    grid = make_grid(job, job->intervals);
    good = fit_structure(job, &grid, &fit);
    if (good) {
        job->bank.autocorrelation_samples = fit.autocorrelation_samples;
        make_model(job, &grid, &fit, model);
        take_notes(job, &fit, notes);
    }
    preisach_fit_free(&fit);
    free_grid(&grid);
    return good;
}

static bool fit(const family_job_t *family_job, model_t *model, family_notes_t *notes, failure_t *failure) {
    const size_t count = family_job->count;
    preisach_job_t job = {.job = family_job,
                          .failure = failure,
                          .bank = {.job = family_job,
                                   .failure = failure,
                                   .recordings = family_job->recordings,
                                   .train = allocate(count, sizeof *job.bank.train)},
                          .train = allocate(count, sizeof *job.train),
                          .past_v = allocate(count, sizeof *job.past_v)};
    const bool good = fit_prepared(&job, model, notes);
    if (job.bank.elastic != NULL) {
        creep_recordings_free(job.bank.elastic, count);
    }
    free(job.bank.train);
    free(job.past_v);
    free(job.train);
    return good;
}

const family_t family_preisach = {
    .name = "preisach",
    .order = 40,
    .text = "relays over the plane of their switching drives; first-order reversal curves, or any drive with many "
            "reversals",
    .fit = fit,
    .finds_creep = true};
