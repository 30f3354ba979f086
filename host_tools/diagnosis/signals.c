/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "signals.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Of the mean size of a parameter's elements: small enough for what bends behind the hysteresis, large enough for
 * double precision. */
static const double step_part = 1e-3;

size_t stage_of(const model_t *model, size_t block) {
    size_t order[MODEL_MAX_BLOCKS], stage = 0;
    chain_order(model, order);
    while (order[stage] != block) {
        stage++;
    }
    return stage;
}

static size_t hysteresis_of(const model_t *model) {
    size_t i = 0;
    while (!block_is_hysteresis(model->block[i].block)) {
        i++;
    }
    return i;
}

size_t hysteresis_stage(const model_t *model) {
    return stage_of(model, hysteresis_of(model));
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
    size_t order[MODEL_MAX_BLOCKS];
    const size_t stages = chain_order(altered, order);
    bool good = true;
    for (size_t i = 0; good && i < samples->count; i++) {
        const recording_t *recording = &samples->recordings[i];
        signal_t *signal = allocate(recording->samples + 1, sizeof *signal);
        failure_t refusal;
        memcpy(signal, signals->before[stage] + begin_of(samples, i), (recording->samples + 1) * sizeof(signal_t));
        good = chain_run(altered, recording, 0, stage, stages, signal, &refusal);
        for (size_t k = 0; good && k < recording->samples; k++) {
            position[samples->begin[i] + k] = signal[1 + k].value;
            good = isfinite(signal[1 + k].value);
        }
        free(signal);
    }
    return good;
}

void hysteresis_numbers(const model_t *model, hysteresis_numbers_t *numbers) {
    const model_block_t *block = &model->block[hysteresis_of(model)];
    size_t most = 0;
    for (size_t p = 0; p < block->block->parameters; p++) {
        most += block->parameter[p].count;
    }
    *numbers = (hysteresis_numbers_t){.number = allocate(most, sizeof(double *)),
                                      .step = allocate(most, sizeof(double)),
                                      .mean_size = allocate(most, sizeof(double)),
                                      .lower = allocate(most, sizeof(double))};
    for (size_t p = 0; p < block->block->parameters; p++) {
        const parameter_t *parameter = &block->parameter[p];
        const parameter_info_t *info = &block->block->parameter[p];
        double mean = 0.0, least = HUGE_VAL;
        for (size_t e = 0; e < parameter->count; e++) {
            mean += fabs(parameter->value[e]) / (double)parameter->count;
            least = fmin(least, parameter->value[e]);
        }
        for (size_t e = 0; e < parameter->count && !info->chosen; e++) {
            const double low = info->array && strcmp(info->name, "weights") == 0 && least >= 0.0 ? 0.0 : info->low;
            numbers->number[numbers->count] = &parameter->value[e];
            numbers->mean_size[numbers->count] = mean > 0.0 ? mean : 1.0;
            numbers->step[numbers->count] = step_part * numbers->mean_size[numbers->count];
            numbers->lower[numbers->count++] = fmin(0.0, low - parameter->value[e]);
        }
    }
}

void hysteresis_numbers_free(hysteresis_numbers_t *numbers) {
    free(numbers->number);
    free(numbers->step);
    free(numbers->mean_size);
    free(numbers->lower);
    *numbers = (hysteresis_numbers_t){0};
}

bool signals_derivative(const signals_t *signals, const model_t *model, const hysteresis_numbers_t *numbers,
                        size_t number, double *column) {
    const size_t stage = hysteresis_stage(model);
    const double kept = *numbers->number[number];
    double step = numbers->step[number];
    *numbers->number[number] = kept + step;
    bool good = signals_altered(signals, model, stage, column);
    if (!good) {
        step = -step;
        *numbers->number[number] = kept + step;
        good = signals_altered(signals, model, stage, column);
    }
    *numbers->number[number] = kept;
    for (size_t k = 0; good && k < signals->samples->all; k++) {
        column[k] = (column[k] - signals->simulated[k]) / step;
    }
    return good;
}
