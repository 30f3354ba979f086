/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/nuisance/past_choice.h"
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

/* A sweep that ended there. */
static void set_past(model_block_t *hysteresis, double end_v, bool low) {
    if (hysteresis->block->operators != OPERATORS_PLAYS) {
        model_set_array(hysteresis, "past_v", 1, &end_v, NULL);
        return;
    }
    const parameter_t *threshold_v = model_parameter(hysteresis, "thresholds_v");
    double *memory_v = allocate(threshold_v->count, sizeof(double));
    for (size_t i = 0; i < threshold_v->count; i++) {
        memory_v[i] = low ? end_v + threshold_v->value[i] : end_v - threshold_v->value[i];
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
        set_past(&other[end].block[hysteresis_index(&other[end])], range_v[end], end == 0);
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
