/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/nuisance/signals.h"
#include "chain/chain_stream.h"
#include "diagnosis/nuisance/linear_outputs.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

size_t stage_of(const model_t *model, size_t block) {
    size_t order[MODEL_MAX_BLOCKS], stage = 0;
    chain_order(model, order);
    while (order[stage] != block) {
        stage++;
    }
    return stage;
}

size_t hysteresis_stage(const model_t *model) {
    return stage_of(model, hysteresis_index(model));
}

/* Signals of a recording begin behind those of the ones before, each with one element more than samples. */
static size_t begin_of(const samples_t *samples, size_t recording) {
    return samples->begin[recording] + recording;
}

static size_t length_of(const samples_t *samples) {
    return samples->all + samples->count;
}

bool signals_open(signals_t *signals, const samples_t *samples, const model_t *model, failure_t *failure) {
    size_t order[MODEL_MAX_BLOCKS];
    bool good = true;
    *signals = (signals_t){.samples = samples, .model = model, .stages = chain_order(model, order)};
    signals->before = allocate(signals->stages + 1, sizeof(signal_t *));
    signals->simulated = samples_column(samples);
    for (size_t stage = 0; stage <= signals->stages; stage++) {
        signals->before[stage] = allocate(length_of(samples), sizeof(signal_t));
    }
    for (size_t i = 0; i < samples->count; i++) {
        const recording_t *recording = &samples->recordings[i];
        signal_t *first = signals->before[0] + begin_of(samples, i);
        first[0].value = recording->column[COLUMN_DRIVE][0];
        for (size_t k = 0; k < recording->samples; k++) {
            first[1 + k].value = recording->column[COLUMN_DRIVE][k];
        }
        for (size_t stage = 0; good && stage < signals->stages; stage++) {
            signal_t *next = signals->before[stage + 1] + begin_of(samples, i);
            if (stage == hysteresis_stage(model) && !recording->held) {
                chain_note_turns(signals->before[stage] + begin_of(samples, i), recording->samples);
            }
            memcpy(next, signals->before[stage] + begin_of(samples, i), (recording->samples + 1) * sizeof(signal_t));
            good = chain_run(model, recording, 0, stage, stage + 1, next, failure);
        }
        for (size_t k = 0; k < recording->samples; k++) {
            signals->simulated[samples->begin[i] + k] =
                signals->before[signals->stages][begin_of(samples, i) + 1 + k].value;
        }
    }
    if (!good) {
        signals_close(signals);
    }
    return good;
}

void signals_close(signals_t *signals) {
    for (size_t stage = 0; signals->before != NULL && stage <= signals->stages; stage++) {
        free(signals->before[stage]);
    }
    free(signals->before);
    free(signals->simulated);
    *signals = (signals_t){0};
}

bool signals_altered(const signals_t *signals, const model_t *altered, size_t stage, double *position) {
    const samples_t *samples = signals->samples;
    bool good = true;
    for (size_t i = 0; good && i < samples->count; i++) {
        failure_t refusal;
        good = chain_stream_position(altered, &samples->recordings[i], stage,
                                     signals->before[stage] + begin_of(samples, i), NULL, position + samples->begin[i],
                                     &refusal);
    }
    return good;
}

void signals_differentiate(signals_t *signals, const hysteresis_numbers_t *numbers) {
    const size_t stage = hysteresis_stage(signals->model);
    const samples_t *samples = signals->samples;
    linear_outputs_t *linear = linear_outputs_open(&signals->model->block[hysteresis_index(signals->model)], numbers);
    double **column = allocate(numbers->count + 1, sizeof(double *));
    bool good = linear != NULL;
    signals->outputs = numbers->count;
    signals->output = allocate(numbers->count + 1, sizeof(double *));
    for (size_t n = 0; n < numbers->count; n++) {
        signals->output[n] = linear_outputs_has(linear, n) ? samples_column(samples) : NULL;
    }
    for (size_t i = 0; good && i < samples->count; i++) {
        for (size_t n = 0; n < numbers->count; n++) {
            column[n] = signals->output[n] != NULL ? signals->output[n] + samples->begin[i] : NULL;
        }
        good = linear_outputs_run(linear, signals->before[stage] + begin_of(samples, i), samples->recordings[i].samples,
                                  column);
    }
    if (!good) {
        signals_forget(signals);
    }
    free(column);
    linear_outputs_close(linear);
}

void signals_forget(signals_t *signals) {
    for (size_t n = 0; n < signals->outputs; n++) {
        free(signals->output[n]);
    }
    free(signals->output);
    signals->output = NULL;
    signals->outputs = 0;
}

/* The hysteresis puts out `step` times `output` more. */
static bool with_output(const signals_t *signals, const double *output, double step, double *column) {
    const samples_t *samples = signals->samples;
    const size_t stage = hysteresis_stage(signals->model);
    bool good = true;
    if (stage + 1 == signals->stages) {
        memcpy(column, output, samples->all * sizeof(double));
        return true;
    }
    for (size_t i = 0; good && i < samples->count; i++) {
        const recording_t *r = &samples->recordings[i];
        const size_t from = samples->begin[i];
        const stream_added_t added = {output + from, step};
        failure_t refusal;
        good = chain_stream_position(signals->model, r, stage + 1, signals->before[stage + 1] + begin_of(samples, i),
                                     &added, column + from, &refusal);
        for (size_t k = 0; k < r->samples; k++) {
            column[from + k] = (column[from + k] - signals->simulated[from + k]) / step;
        }
    }
    return good;
}

static bool with_number(const signals_t *signals, const hysteresis_numbers_t *numbers, size_t number, double change,
                        double *column) {
    model_t changed;
    hysteresis_number_changed(numbers, number, change, signals->model, &changed);
    const bool good = signals_altered(signals, &changed, hysteresis_stage(&changed), column);
    model_free(&changed);
    return good;
}

bool signals_derivative(const signals_t *signals, const hysteresis_numbers_t *numbers, size_t number, double *column) {
    double step = numbers->number[number].step;
    if (signals->output != NULL && signals->output[number] != NULL &&
        with_output(signals, signals->output[number], step, column)) {
        return true;
    }
    bool good = with_number(signals, numbers, number, step, column);
    if (!good) {
        step = -step;
        good = with_number(signals, numbers, number, step, column);
    }
    for (size_t k = 0; good && k < signals->samples->all; k++) {
        column[k] = (column[k] - signals->simulated[k]) / step;
    }
    return good;
}
