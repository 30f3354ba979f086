/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "refine_problem.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Of a number's size: rounding in the simulation (1e-16) then costs 1e-10 of a derivative, curvature 1e-6. */
static const double relative_step = 1e-6;
/* Of the displacement. A difference between two simulations that is everywhere below it is rounding: no effect. */
static const double rounding = 1e-13;

static double peak_to_peak(const double *values, size_t from, size_t to) {
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (size_t k = from; k < to; k++) {
        low = fmin(low, values[k]);
        high = fmax(high, values[k]);
    }
    return high - low;
}

/* Adds a recording to what is known of all. */
static void measure_recording(refine_problem_t *problem, size_t i) {
    const recording_t *recording = &problem->job->recordings[i];
    const double *displacement = recording->column[COLUMN_DISPLACEMENT];
    const size_t from = problem->from[i], to = problem->to[i];
    double mean = 0.0;
    for (size_t k = from; k < to; k++) {
        mean += displacement[k] / (double)(to - from);
        problem->largest_um = fmax(problem->largest_um, fabs(displacement[k]));
    }
    for (size_t k = from; k < to; k++) {
        problem->power += (displacement[k] - mean) * (displacement[k] - mean);
    }
    problem->stroke_um = fmax(problem->stroke_um, peak_to_peak(displacement, from, to));
    problem->drive_v = fmax(problem->drive_v, peak_to_peak(recording->column[COLUMN_DRIVE], from, to));
    problem->duration_s = fmax(problem->duration_s, (double)(to - from) / recording->sample_rate_hz);
    problem->samples += to - from;
}

bool refine_problem_open(refine_problem_t *problem, model_t *model, const refine_job_t *job, failure_t *failure) {
    *problem = (refine_problem_t){.model = model,
                                  .job = job,
                                  .from = allocate(job->count, sizeof(size_t)),
                                  .to = allocate(job->count, sizeof(size_t)),
                                  .preload_n = allocate(job->count, sizeof(double))};
    if (!model_check(model, "model", failure)) {
        return false;
    }
    problem->stages = chain_order(model, problem->order);
    for (size_t i = 0; i < job->count; i++) {
        problem->to[i] = job->to != NULL ? job->to[i] : job->recordings[i].samples;
        if (!recording_preload(&job->recordings[i], &problem->preload_n[i], failure)) {
            return false;
        }
    }
    if (job->from != NULL) {
        memcpy(problem->from, job->from, job->count * sizeof(size_t));
    } else if (!chain_determined_from(model, job->recordings, job->count, problem->to, problem->from)) {
        memset(problem->from, 0, job->count * sizeof(size_t));
    }
    for (size_t i = 0; i < job->count; i++) {
        measure_recording(problem, i);
    }
    return problem->samples > job->unknowns + job->count ||
           fail(failure, "%zu samples count: too few for %zu unknowns", problem->samples, job->unknowns);
}

void refine_problem_free(refine_problem_t *problem) {
    free(problem->from);
    free(problem->to);
    free(problem->preload_n);
    memset(problem, 0, sizeof *problem);
}

double *refine_value(const refine_problem_t *problem, size_t unknown) {
    const refine_unknown_t *u = &problem->job->unknown[unknown];
    return &problem->model->block[u->block].parameter[u->parameter].value[u->element];
}

double refine_get(const refine_problem_t *problem, size_t unknown) {
    const double value = *refine_value(problem, unknown);
    return problem->job->unknown[unknown].logarithmic ? log(value) : value;
}

void refine_set(const refine_problem_t *problem, size_t unknown, double x) {
    const refine_unknown_t *u = &problem->job->unknown[unknown];
    /* exp(log(high)) may be one rounding above high */
    *refine_value(problem, unknown) = u->logarithmic ? fmin(fmax(exp(x), u->low), u->high) : x;
}

double refine_low(const refine_problem_t *problem, size_t unknown) {
    const refine_unknown_t *u = &problem->job->unknown[unknown];
    return u->logarithmic ? log(u->low) : u->low;
}

double refine_high(const refine_problem_t *problem, size_t unknown) {
    const refine_unknown_t *u = &problem->job->unknown[unknown];
    return u->logarithmic ? log(u->high) : u->high;
}

static void run_stage(const refine_problem_t *problem, size_t recording, size_t stage, signal_t *signal) {
    const stage_setup_t setup = {.sample_rate_hz = problem->job->recordings[recording].sample_rate_hz,
                                 .preload_n = problem->preload_n[recording]};
    chain_run_block(problem->model, problem->order[stage], &setup, problem->to[recording], signal);
}

static signal_t *drive_signal(const refine_problem_t *problem, size_t recording) {
    const double *drive = problem->job->recordings[recording].column[COLUMN_DRIVE];
    signal_t *signal = allocate(problem->to[recording] + 1, sizeof *signal);
    signal[0].value = drive[0];
    for (size_t k = 0; k < problem->to[recording]; k++) {
        signal[k + 1].value = drive[k];
    }
    return signal;
}

static double take_out_mean(double *values, size_t count) {
    double mean = 0.0;
    for (size_t k = 0; k < count; k++) {
        mean += values[k] / (double)count;
    }
    for (size_t k = 0; k < count; k++) {
        values[k] -= mean;
    }
    return mean;
}

/* What is left of the displacement at the end of the chain. */
static bool residual_of(const refine_problem_t *problem, size_t i, const signal_t *position, double *residual,
                        double *offset_um) {
    const double *displacement = problem->job->recordings[i].column[COLUMN_DISPLACEMENT];
    const size_t from = problem->from[i], count = problem->to[i] - from;
    double sum = 0.0;
    for (size_t k = 0; k < count; k++) {
        residual[k] = displacement[from + k] - position[from + k + 1].value;
        sum += residual[k];
    }
    *offset_um = problem->job->offsets ? take_out_mean(residual, count) : 0.0;
    return isfinite(sum);
}

bool refine_residual(const refine_problem_t *problem, size_t i, double *residual, double *offset_um) {
    signal_t *signal = drive_signal(problem, i);
    bool good;
    for (size_t stage = 0; stage < problem->stages; stage++) {
        run_stage(problem, i, stage, signal);
    }
    good = residual_of(problem, i, signal, residual, offset_um);
    free(signal);
    return good;
}

double refine_cost(const refine_problem_t *problem) {
    double cost = 0.0, offset_um;
    failure_t refused;
    if (!model_check(problem->model, "model", &refused)) {
        return HUGE_VAL;
    }
    for (size_t i = 0; i < problem->job->count && isfinite(cost); i++) {
        const size_t count = problem->to[i] - problem->from[i];
        double *residual = allocate(count, sizeof(double));
        if (!refine_residual(problem, i, residual, &offset_um)) {
            cost = HUGE_VAL;
        }
        for (size_t k = 0; k < count; k++) {
            cost += residual[k] * residual[k];
        }
        free(residual);
    }
    return isfinite(cost) ? cost : HUGE_VAL;
}

static size_t stage_of(const refine_problem_t *problem, size_t unknown) {
    size_t stage = 0;
    while (problem->order[stage] != problem->job->unknown[unknown].block) {
        stage++;
    }
    return stage;
}

/* Derivative of the position by one unknown, from a step of `step`, with what enters every stage in `input`; false when
 * the model takes no such step. */
static bool difference(const refine_problem_t *problem, size_t i, size_t unknown, double step, const signal_t *input,
                       const double *residual, double *column) {
    const size_t first = stage_of(problem, unknown), length = problem->to[i] + 1;
    const double x = refine_get(problem, unknown);
    const double value = *refine_value(problem, unknown);
    double offset_um, effect_um = 0.0;
    failure_t refused;
    bool good;
    if (x + step < refine_low(problem, unknown) || x + step > refine_high(problem, unknown)) {
        return false;
    }
    refine_set(problem, unknown, x + step);
    good = model_check(problem->model, "model", &refused);
    if (good) {
        signal_t *signal = allocate(length, sizeof *signal);
        memcpy(signal, input + first * length, length * sizeof *signal);
        for (size_t stage = first; stage < problem->stages; stage++) {
            run_stage(problem, i, stage, signal);
        }
        good = residual_of(problem, i, signal, column, &offset_um);
        free(signal);
    }
    *refine_value(problem, unknown) = value;
    for (size_t k = 0; good && k < problem->to[i] - problem->from[i]; k++) {
        column[k] = residual[k] - column[k];
        effect_um = fmax(effect_um, fabs(column[k]));
    }
    for (size_t k = 0; good && k < problem->to[i] - problem->from[i]; k++) {
        column[k] = effect_um > rounding * problem->largest_um ? column[k] / step : 0.0;
    }
    return good;
}

static void fill_column(const refine_problem_t *problem, size_t i, size_t unknown, const signal_t *input,
                        const double *residual, double *column) {
    const double x = refine_get(problem, unknown), width = refine_high(problem, unknown) - refine_low(problem, unknown);
    const double size = problem->job->unknown[unknown].logarithmic ? 1.0 : x != 0.0 ? fabs(x) : fmin(width, 1.0);
    if (!difference(problem, i, unknown, relative_step * size, input, residual, column) &&
        !difference(problem, i, unknown, -relative_step * size, input, residual, column)) {
        memset(column, 0, (problem->to[i] - problem->from[i]) * sizeof(double)); /* as if it had no effect */
    }
}

static void add_recording(const refine_problem_t *problem, size_t i, normal_equations_t *equations) {
    const size_t n = problem->job->unknowns, count = problem->to[i] - problem->from[i], length = problem->to[i] + 1;
    signal_t *input = allocate(problem->stages * length, sizeof *input), *signal = drive_signal(problem, i);
    double *residual = allocate(count, sizeof(double)), *columns = allocate(n * count, sizeof(double)),
           *row = allocate(n, sizeof(double)), offset_um;
    for (size_t stage = 0; stage < problem->stages; stage++) {
        memcpy(input + stage * length, signal, length * sizeof *signal);
        run_stage(problem, i, stage, signal);
    }
    residual_of(problem, i, signal, residual, &offset_um);
    for (size_t u = 0; u < n; u++) {
        fill_column(problem, i, u, input, residual, columns + u * count);
    }
    for (size_t k = 0; k < count; k++) {
        for (size_t u = 0; u < n; u++) {
            row[u] = columns[u * count + k];
        }
        normal_equations_add(equations, row, residual[k]);
    }
    free(input);
    free(signal);
    free(residual);
    free(columns);
    free(row);
}

void refine_equations(const refine_problem_t *problem, normal_equations_t *equations) {
    normal_equations_create(equations, problem->job->unknowns);
    for (size_t i = 0; i < problem->job->count; i++) {
        add_recording(problem, i, equations);
    }
    normal_equations_finish(equations);
}
