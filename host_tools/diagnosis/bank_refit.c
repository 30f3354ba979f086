/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "bank_refit.h"
#include "evidence.h"
#include "least_squares.h"
#include <math.h>
#include <stdlib.h>

/* Of the mean weight: small enough for what bends behind the bank, large enough for double precision. */
static const double step_part = 1e-3;

typedef struct {
    model_t *model;
    size_t operators;
    double *offset, *weight, step;
} bank_t;

static double *number(const bank_t *bank, size_t j) {
    return j == 0 ? bank->offset : &bank->weight[j - 1];
}

/* Adds a recording's rows: derivatives by offset and weights, and what is left of the displacement. */
static bool add_recording(const bank_t *bank, const recording_t *recording, normal_equations_t *equations,
                          failure_t *failure) {
    const size_t unknowns = bank->operators + 2, samples = recording->samples;
    const size_t determined = chain_memory_determined(bank->model, recording, samples);
    const size_t from = samples - determined < samples / 4 ? 0 : determined;
    double *base = allocate(samples, sizeof(double)), *columns = allocate(unknowns * samples, sizeof(double)),
           *row = allocate(unknowns, sizeof(double));
    bool good = chain_simulate(bank->model, recording, 0, base, failure);
    for (size_t j = 0; good && j < unknowns; j++) {
        const double kept = *number(bank, j);
        *number(bank, j) += bank->step;
        good = chain_simulate(bank->model, recording, 0, columns + j * samples, failure);
        *number(bank, j) = kept;
    }
    for (size_t k = from; good && k < samples; k++) {
        if (!held_out(samples, k)) {
            for (size_t j = 0; j < unknowns; j++) {
                row[j] = (columns[j * samples + k] - base[k]) / bank->step;
            }
            normal_equations_add(equations, row, recording->column[COLUMN_DISPLACEMENT][k] - base[k]);
        }
    }
    free(base);
    free(columns);
    free(row);
    return good;
}

bool bank_refit(model_t *model, const recording_t *recordings, size_t count, failure_t *failure) {
    const model_block_t *block = model_find(model, "prandtl_ishlinskii");
    bank_t bank = {.model = model,
                   .operators = model_parameter(block, "thresholds_v")->count,
                   .offset = model_parameter(block, "offset_um")->value,
                   .weight = model_parameter(block, "weights")->value};
    const size_t unknowns = bank.operators + 2;
    double *change = allocate(unknowns, sizeof(double)), *lower = allocate(unknowns, sizeof(double));
    normal_equations_t equations;
    bool good = true;
    normal_equations_create(&equations, unknowns);
    lower[0] = -HUGE_VAL;
    for (size_t j = 1; j < unknowns; j++) {
        bank.step += step_part * fabs(*number(&bank, j)) / (double)(unknowns - 1);
        lower[j] = -*number(&bank, j);
    }
    for (size_t i = 0; good && i < count; i++) {
        good = add_recording(&bank, &recordings[i], &equations, failure);
    }
    normal_equations_finish(&equations);
    good = good && solve_bounded(&equations, lower, change, NULL, failure);
    for (size_t j = 0; good && j < unknowns; j++) {
        *number(&bank, j) += change[j];
    }
    normal_equations_free(&equations);
    free(change);
    free(lower);
    return good;
}
