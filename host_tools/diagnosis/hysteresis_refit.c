/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "hysteresis_refit.h"
#include "evidence.h"
#include "least_squares.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Of the mean size of a parameter's elements: small enough for what bends behind the hysteresis, large enough for
 * double precision. */
static const double step_part = 1e-3;

/* Weight of a number's change, in parts of the mean weight that the samples give it: for a bank, whose numbers are few,
 * and for a table. */
static const double stay_part_few = 1e-9, stay_part_many = 1e-3;
static const size_t many = 65;

typedef struct {
    model_t *model;
    size_t numbers;
    double **number; /* where they stand in the model */
    double *step, *lower;
} refit_t;

static const model_block_t *hysteresis_of(const model_t *model) {
    size_t i = 0;
    while (!block_is_hysteresis(model->block[i].block)) {
        i++;
    }
    return &model->block[i];
}

static void collect(refit_t *refit) {
    const model_block_t *block = hysteresis_of(refit->model);
    size_t most = 0;
    for (size_t p = 0; p < block->block->parameters; p++) {
        most += block->parameter[p].count;
    }
    refit->number = allocate(most, sizeof *refit->number);
    refit->step = allocate(most, sizeof(double));
    refit->lower = allocate(most, sizeof(double));
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
            refit->number[refit->numbers] = &parameter->value[e];
            refit->step[refit->numbers] = step_part * (mean > 0.0 ? mean : 1.0);
            refit->lower[refit->numbers++] = fmin(0.0, low - parameter->value[e]);
        }
    }
}

/* Adds a recording's rows: derivatives by the numbers, and what is left of the displacement. */
static bool add_recording(const refit_t *refit, const recording_t *recording, normal_equations_t *equations,
                          failure_t *failure) {
    const size_t samples = recording->samples, n = refit->numbers;
    const size_t from = first_that_counts(refit->model, recording);
    double *base = allocate(samples, sizeof(double)), *columns = allocate(n * samples, sizeof(double)),
           *row = allocate(n, sizeof(double));
    bool good = chain_simulate(refit->model, recording, 0, base, failure);
    for (size_t j = 0; good && j < n; j++) {
        const double kept = *refit->number[j];
        *refit->number[j] += refit->step[j];
        good = chain_simulate(refit->model, recording, 0, columns + j * samples, failure);
        *refit->number[j] = kept;
    }
    for (size_t k = from; good && k < samples; k++) {
        if (!held_out(samples, k)) {
            for (size_t j = 0; j < n; j++) {
                row[j] = (columns[j * samples + k] - base[k]) / refit->step[j];
            }
            normal_equations_add(equations, row, recording->column[COLUMN_DISPLACEMENT][k] - base[k]);
        }
    }
    free(base);
    free(columns);
    free(row);
    return good;
}

/* What the samples say nothing about stays as the family's own fit has left it. */
static void stay_near(const refit_t *refit, normal_equations_t *equations) {
    const size_t n = refit->numbers;
    double *row = allocate(n, sizeof(double)), mean = 0.0;
    for (size_t j = 0; j < n; j++) {
        mean += equations->gram[j * n + j] / (double)n;
    }
    for (size_t j = 0; j < n; j++) {
        row[j] = 1.0;
        normal_equations_penalise(equations, row, (n < many ? stay_part_few : stay_part_many) * mean);
        row[j] = 0.0;
    }
    free(row);
}

/* Takes the step, half of it, a quarter .. where the hysteresis has no such numbers; none in the end. */
static void apply(const refit_t *refit, const double *change) {
    failure_t refusal;
    double part = 1.0;
    for (int halvings = 0; halvings < 6; halvings++) {
        for (size_t j = 0; j < refit->numbers; j++) {
            *refit->number[j] += part * change[j];
        }
        if (model_check(refit->model, "model", &refusal)) {
            return;
        }
        for (size_t j = 0; j < refit->numbers; j++) {
            *refit->number[j] -= part * change[j];
        }
        part *= 0.5;
    }
}

bool hysteresis_refit(model_t *model, const recording_t *recordings, size_t count, failure_t *failure) {
    refit_t refit = {.model = model};
    normal_equations_t equations;
    double *change;
    bool good = true;
    collect(&refit);
    change = allocate(refit.numbers, sizeof(double));
    normal_equations_create(&equations, refit.numbers);
    for (size_t i = 0; good && i < count; i++) {
        good = add_recording(&refit, &recordings[i], &equations, failure);
    }
    normal_equations_finish(&equations);
    stay_near(&refit, &equations);
    good = good && solve_bounded(&equations, refit.lower, change, NULL, failure);
    if (good) {
        apply(&refit, change);
    }
    normal_equations_free(&equations);
    free(refit.number);
    free(refit.step);
    free(refit.lower);
    free(change);
    return good;
}
