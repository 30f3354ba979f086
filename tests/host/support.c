/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "support.h"
#include "unity.h"
#include <gsl/gsl_math.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

void write_file(const char *name, const char *content, size_t length) {
    FILE *file = fopen(name, "wb");
    TEST_ASSERT_NOT_NULL(file);
    TEST_ASSERT_EQUAL_UINT64(length, fwrite(content, 1, length, file));
    TEST_ASSERT_EQUAL_INT(0, fclose(file));
}

void expect_line(const failure_t *failure, const char *text) {
    TEST_ASSERT_NULL_MESSAGE(strchr(failure->text, '\n'), failure->text);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(failure->text, text), failure->text);
}

void make_bank_model(model_t *model, double sample_rate_hz, double offset_um, size_t operators, const double *weights,
                     const double *thresholds_v) {
    model_block_t *block;
    model_create(model, sample_rate_hz);
    block = model_append(model, &block_prandtl_ishlinskii);
    model_set(block, "offset_um", offset_um);
    model_set_array(block, "weights", operators + 1, weights, NULL);
    model_set_array(block, "thresholds_v", operators, thresholds_v, NULL);
}

void make_fine_bank_model(model_t *model, double sample_rate_hz, size_t operators) {
    enum { MOST = 200 };
    double weights[MOST + 1] = {0.05}, thresholds[MOST];
    TEST_ASSERT_TRUE(operators <= MOST);
    for (size_t i = 0; i < operators; i++) {
        thresholds[i] = 48.0 * ((double)i + 0.5) / (double)operators;
        weights[i + 1] = 0.5 / (double)operators * exp(-thresholds[i] / 12.0);
    }
    make_bank_model(model, sample_rate_hz, 0.0, operators, weights, thresholds);
}

void insert_block(model_t *model, const model_t *shorter, const block_t *block, const double *value) {
    model_copy(model, shorter);
    model_append(model, block);
    const model_block_t inserted = model->block[model->blocks - 1];
    for (size_t p = 0; p < block->parameters; p++) {
        if (!block->parameter[p].array) {
            inserted.parameter[p].value[0] = value[p];
        }
    }
    size_t at = model->blocks - 1;
    for (; at > 0 && model->block[at - 1].block->place > block->place; at--) {
        model->block[at] = model->block[at - 1];
    }
    model->block[at] = inserted;
}

/* Returns the index of the block. */
static size_t make_block_model(model_t *model, const block_t *block, const double *values, double rate_hz) {
    static const double one = 1.0;
    const bool behind = block->place > PLACE_HYSTERESIS;
    model_create(model, rate_hz);
    for (int i = 0; i < 2; i++) {
        if ((i == 1) != behind) {
            model_block_t *bank = model_append(model, &block_prandtl_ishlinskii);
            model_set_array(bank, "weights", 1, &one, NULL);
            continue;
        }
        model_block_t *appended = model_append(model, block);
        for (size_t p = 0; p < block->parameters; p++) {
            if (!block->parameter[p].array) {
                model_set(appended, block->parameter[p].name, values[p]);
            }
        }
    }
    return behind ? 1 : 0;
}

chain_t *open_block(const block_t *block, const double *values, double rate_hz, uint64_t seed) {
    model_t model;
    failure_t failure = {{0}};
    make_block_model(&model, block, values, rate_hz);
    chain_t *chain = chain_open(&model, rate_hz, seed, &failure);
    TEST_ASSERT_NOT_NULL_MESSAGE(chain, failure.text);
    model_free(&model);
    return chain;
}

void pass_block(const block_t *block, const double *values, double rate_hz, size_t count, double *x) {
    const recording_t recording = {.sample_rate_hz = rate_hz, .samples = count};
    model_t model;
    const size_t index = make_block_model(&model, block, values, rate_hz);
    chain_pass(&model, index, &recording, x);
    model_free(&model);
}

void simulate_into(recording_t *recording, const model_t *model, uint64_t seed) {
    failure_t failure = {{0}};
    TEST_ASSERT_TRUE_MESSAGE(chain_simulate(model, recording, seed, recording->column[COLUMN_DISPLACEMENT], &failure),
                             failure.text);
}

void measure_with(recording_t *recording, const model_t *shorter, const block_t *block, const double *value,
                  double noise_um, random_t *rng) {
    model_t with;
    insert_block(&with, shorter, block, value);
    simulate_into(recording, &with, 1);
    model_free(&with);
    for (size_t k = 0; k < recording->samples; k++) {
        recording->column[COLUMN_DISPLACEMENT][k] += noise_um * random_normal(rng);
    }
}

double magnetised(double m, double h, double dh) {
    const double anhysteretic = tanh((h + 0.05 * m) / 0.6), away = (anhysteretic - m) * copysign(1.0, dh);
    const double irreversible = away > 0.0 ? away / (0.35 - 0.05 * away) : 0.0;
    return m + dh * (irreversible + 0.2 * (1.0 - anhysteretic * anhysteretic) / 0.6) / 1.2;
}

void fill_lines(double *values, size_t samples, const double *corner, size_t count, size_t per_line) {
    for (size_t k = 0; k < samples; k++) {
        const size_t line = k / per_line;
        const double from = corner[line % count], to = corner[(line + 1) % count];
        values[k] = from + (to - from) * (double)(k % per_line) / (double)per_line;
    }
}

void fill_tones(double *drive, size_t samples, double rate_hz, double highest_hz, random_t *rng) {
    enum { TONES = 40 };
    const double lowest_hz = 0.5;
    double phase[TONES], range[2];
    for (size_t i = 0; i < TONES; i++) {
        phase[i] = 2.0 * M_PI * random_unit(rng);
    }
    for (size_t k = 0; k < samples; k++) {
        drive[k] = 0.0;
        for (size_t i = 0; i < TONES; i++) {
            const double hz = lowest_hz * pow(highest_hz / lowest_hz, ((double)i + 0.3 * sin((double)i)) / TONES);
            drive[k] += pow(hz, -0.7) * sin(2.0 * M_PI * hz * (double)k / rate_hz + phase[i]);
        }
    }
    for (size_t k = 0; k < samples; k++) {
        const size_t in_third = k % (samples / 3);
        drive[k] = in_third > samples / 4 ? drive[k - 1] : drive[k];
    }
    values_range(drive, samples, range);
    for (size_t k = 0; k < samples; k++) {
        drive[k] = 2.0 + 96.0 * (drive[k] - range[0]) / (range[1] - range[0]);
    }
}

void make_modified_play_model(model_t *model, double sample_rate_hz, double bilinear, double frequency_hz) {
    enum { CELLS = 45 };
    static const double mode[3] = {2.35, -1.95, 0.58}, harmonics[6] = {0.03, 0.0, 0.0, -0.05, 0.0, 0.0};
    double cells[CELLS];
    for (int i = 0; i < CELLS; i++) {
        cells[i] = 0.012 * (1.0 + 0.5 * sin(0.7 * i));
    }
    model_create(model, sample_rate_hz);
    model_block_t *block = model_append(model, &block_modified_play);
    model_set(block, "half_range_v", 75.0);
    model_set(block, "direct_um", 1.4);
    model_set(block, "offset_um", 0.1);
    model_set_array(block, "cells_um", CELLS, cells, NULL);
    model_set_array(block, "feedback", 3, mode, NULL);
    model_set(block, "bilinear_gain", bilinear);
    model_set_array(block, "harmonics_um", 6, harmonics, NULL);
    model_set(block, "frequency_hz", frequency_hz);
    model_set(block, "phase_rad", 0.4);
}
