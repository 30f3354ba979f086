/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/nuisance/past_choice.h"
#include "base/parallel.h"
#include "diagnosis/nuisance/hysteresis_numbers.h"
#include <gsl/gsl_statistics_double.h>
#include <math.h>
#include <stdlib.h>

double left_of_beginning(void *context, const samples_t *samples, model_t *model) {
    (void)context;
    double *simulated = samples_column(samples), sum = 0.0;
    failure_t refusal;
    const bool good = samples_simulate(samples, model, simulated, &refusal);
    for (size_t i = 0; good && i < samples->count; i++) {
        double *left = simulated + samples->begin[i];
        for (size_t k = 0; k < samples->from[i]; k++) {
            left[k] -= samples->recordings[i].column[COLUMN_DISPLACEMENT][k];
        }
        sum += samples->from[i] > 0 ? gsl_stats_tss(left, 1, samples->from[i]) : 0.0;
    }
    free(simulated);
    return good ? sum : HUGE_VAL;
}

/* Drives one after the other; in front of them the hysteresis was swept as far as it goes, from above or from below. */
static void set_past(model_block_t *hysteresis, const double *past_v, size_t count, bool from_above) {
    if (hysteresis->block->operators != OPERATORS_PLAYS) {
        model_set_array(hysteresis, "past_v", count, past_v, NULL);
        return;
    }
    const parameter_t *threshold_v = model_parameter(hysteresis, "thresholds_v");
    double *memory_v = allocate(threshold_v->count, sizeof(double));
    for (size_t i = 0; i < threshold_v->count; i++) {
        const double r = threshold_v->value[i];
        memory_v[i] = from_above ? past_v[0] + r : past_v[0] - r;
        for (size_t p = 1; p < count; p++) {
            memory_v[i] = fmax(past_v[p] - r, fmin(past_v[p] + r, memory_v[i]));
        }
    }
    model_set_array(hysteresis, "initial_memory_v", threshold_v->count, memory_v, NULL);
    free(memory_v);
}

bool choose_past(const samples_t *samples, left_of_past_t *left_of, void *context, model_t *model) {
    double range_v[2];
    model_t other[2];
    recordings_range(samples->recordings, samples->count, COLUMN_DRIVE, range_v);
    for (size_t end = 0; end < 2; end++) {
        model_copy(&other[end], model);
        set_past(&other[end].block[hysteresis_index(&other[end])], &range_v[end], 1, end == 0);
    }
    double least = left_of(context, samples, model);
    bool changed = false;
    for (size_t end = 0; end < 2; end++) {
        const double left = left_of(context, samples, &other[end]);
        if (left < least) {
            const model_t worse = *model;
            *model = other[end];
            other[end] = worse;
            least = left;
            changed = true;
        }
        model_free(&other[end]);
    }
    return changed;
}

enum { LEVELS = 5, SWEPT = LEVELS * LEVELS, DEMAGNETISED = SWEPT, PASTS };

typedef struct {
    const samples_t *samples;
    error_of_model_t *error;
    const model_t *model;
    double range_v[2], left[PASTS];
} pasts_t;

/* From the other end of the range to one level, and on to another; or none. */
static void model_with_past(const pasts_t *job, size_t index, model_t *with) {
    const double step_v = (job->range_v[1] - job->range_v[0]) / (LEVELS - 1);
    const size_t first = index / LEVELS, then = index % LEVELS;
    const double first_v = job->range_v[0] + step_v * (double)first;
    const double then_v = job->range_v[0] + step_v * (double)then;
    const double past_v[] = {job->range_v[first_v < then_v ? 1 : 0], first_v, then_v};
    model_copy(with, job->model);
    model_block_t *hysteresis = &with->block[hysteresis_index(with)];
    if (index == DEMAGNETISED) {
        const bool plays = hysteresis->block->operators == OPERATORS_PLAYS;
        model_set_array(hysteresis, plays ? "initial_memory_v" : "past_v", 0, past_v, NULL);
    } else {
        set_past(hysteresis, past_v, 3, false);
    }
}

static void try_past(void *context, size_t index) {
    pasts_t *job = context;
    model_t with;
    model_with_past(job, index, &with);
    job->left[index] = job->error(job->samples, &with);
    model_free(&with);
}

bool choose_past_by_error(const samples_t *samples, error_of_model_t *error, double least, model_t *model) {
    pasts_t job = {.samples = samples, .error = error, .model = model};
    size_t best = PASTS;
    model_t with;
    recordings_range(samples->recordings, samples->count, COLUMN_DRIVE, job.range_v);
    parallel(PASTS, try_past, &job);
    for (size_t i = 0; i < PASTS; i++) {
        if (job.left[i] < least) {
            least = job.left[i];
            best = i;
        }
    }
    if (best == PASTS) {
        return false;
    }
    model_with_past(&job, best, &with);
    model_free(model);
    *model = with;
    return true;
}
