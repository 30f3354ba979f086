/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "identify/refine_problem.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Of a number's size: rounding in the simulation (1e-16) then costs 1e-10 of a derivative, curvature 1e-6. */
static const double relative_step = 1e-6;
/* Of the displacement. A difference between two simulations that is everywhere below it is rounding: no effect. */
static const double rounding = 1e-13;

static size_t stage_of(const refine_problem_t *problem, size_t unknown) {
    size_t stage = 0;
    while (problem->order[stage] != problem->job->unknown[unknown].block) {
        stage++;
    }
    return stage;
}

/* A step of one unknown for a difference, upwards or downwards, that its range and the model take; 0 if there is none.
 */
static double difference_step(const refine_problem_t *problem, size_t unknown) {
    const double x = refine_get(problem, unknown), width = refine_high(problem, unknown) - refine_low(problem, unknown);
    const double size = problem->job->unknown[unknown].logarithmic ? 1.0 : x != 0.0 ? fabs(x) : fmin(width, 1.0);
    const double value = *refine_value(problem, unknown);
    double step = relative_step * size;
    for (int sign = 0; sign < 2; sign++) {
        failure_t refused;
        bool taken = x + step >= refine_low(problem, unknown) && x + step <= refine_high(problem, unknown);
        if (taken) {
            refine_set(problem, unknown, x + step);
            taken = model_check(problem->model, "model", &refused);
            *refine_value(problem, unknown) = value;
        }
        if (taken) {
            return step;
        }
        step = -step;
    }
    return 0.0;
}

/* Simulations that differ in one unknown each, along one recording. */
typedef struct {
    const refine_problem_t *problem;
    size_t recording;
    const double *step; /* an unknown; 0: none */
    double *effect_um;  /* per unknown: largest difference so far; HUGE_VAL: the simulation diverged */
    chain_stream_t chain, *moved;
    stream_piece_t *entered; /* a stage: what came in there last */
    double *column;          /* an unknown: STREAM_MOST derivatives */
    double *row, *first;     /* of the sample; of the first one that counts, its residual behind it */
    double *sum;             /* an unknown, and the residual: of rows less the first one */
} walk_t;

static void walk_open(walk_t *walk) {
    const refine_problem_t *problem = walk->problem;
    const size_t n = problem->job->unknowns;
    const double *drive_v = problem->job->recordings[walk->recording].column[COLUMN_DRIVE];
    signal_t settled[MODEL_MAX_BLOCKS];
    walk->chain = refine_stream(problem, walk->recording, 0);
    walk->moved = allocate(n, sizeof *walk->moved);
    walk->entered = allocate(problem->stages, sizeof *walk->entered);
    walk->column = allocate(n * STREAM_MOST, sizeof(double));
    walk->row = allocate(n + 1, sizeof(double));
    walk->first = allocate(n + 1, sizeof(double));
    chain_stream_settle(&walk->chain, (signal_t){.value = drive_v[0]}, settled);
    for (size_t u = 0; u < n; u++) {
        const size_t first = walk->step[u] != 0.0 ? stage_of(problem, u) : problem->stages;
        const double value = *refine_value(problem, u);
        if (walk->step[u] != 0.0) {
            refine_set(problem, u, refine_get(problem, u) + walk->step[u]);
        }
        walk->moved[u] = refine_stream(problem, walk->recording, first);
        *refine_value(problem, u) = value;
        if (walk->step[u] != 0.0) {
            chain_stream_settle(&walk->moved[u], settled[first], NULL);
        }
    }
}

static void walk_close(walk_t *walk) {
    for (size_t u = 0; u < walk->problem->job->unknowns; u++) {
        chain_stream_close(&walk->moved[u]);
    }
    chain_stream_close(&walk->chain);
    free(walk->moved);
    free(walk->entered);
    free(walk->column);
    free(walk->row);
    free(walk->first);
}

/* Derivatives of the positions that the chain has given. */
static void fill_column(walk_t *walk, size_t unknown) {
    chain_stream_t *moved = &walk->moved[unknown];
    double *column = walk->column + unknown * STREAM_MOST;
    if (walk->step[unknown] == 0.0) {
        return; /* stays 0, as if it had no effect */
    }
    const stream_piece_t *entered = &walk->entered[moved->first];
    chain_stream_run(moved, entered->signal, entered->count, entered->ends, NULL);
    for (size_t k = 0; k < moved->out; k++) {
        const double difference = moved->signal[k].value - walk->chain.signal[k].value;
        const bool good = isfinite(difference);
        walk->effect_um[unknown] = good ? fmax(walk->effect_um[unknown], fabs(difference)) : HUGE_VAL;
        column[k] = good ? difference / walk->step[unknown] : 0.0;
    }
}

/* Adds sample k, the j-th that the chain has given; rows count from the first one, which changes nothing once means are
 * taken out. */
static void add_row(walk_t *walk, normal_equations_t *equations, size_t k, size_t j) {
    const refine_problem_t *problem = walk->problem;
    const size_t n = problem->job->unknowns;
    const double *displacement = problem->job->recordings[walk->recording].column[COLUMN_DISPLACEMENT];
    for (size_t u = 0; u < n; u++) {
        walk->row[u] = walk->column[u * STREAM_MOST + j];
    }
    walk->row[n] = displacement[k] - walk->chain.signal[j].value;
    if (problem->job->offsets) {
        if (k == problem->from[walk->recording]) {
            memcpy(walk->first, walk->row, (n + 1) * sizeof(double));
        }
        for (size_t u = 0; u <= n; u++) {
            walk->row[u] -= walk->first[u];
            walk->sum[u] += walk->row[u];
        }
    }
    normal_equations_add(equations, walk->row, walk->row[n]);
}

static void add_recording(walk_t *walk, normal_equations_t *equations) {
    const refine_problem_t *problem = walk->problem;
    const size_t to = problem->to[walk->recording];
    stream_piece_t piece;
    walk_open(walk);
    for (size_t start = 0, k = 0; k < to; start += piece.count) {
        chain_stream_fill(&walk->chain, &problem->job->recordings[walk->recording], start, to, &piece);
        chain_stream_run(&walk->chain, piece.signal, piece.count, piece.ends, walk->entered);
        for (size_t u = 0; u < problem->job->unknowns; u++) {
            fill_column(walk, u);
        }
        for (size_t j = 0; j < walk->chain.out && k < to; j++, k++) {
            if (k >= problem->from[walk->recording]) {
                add_row(walk, equations, k, j);
            }
        }
    }
    walk_close(walk);
}

/* Takes the means of a recording's rows out of the equations: sum times sum over count, out of the sums of products. */
static void take_out_means(normal_equations_t *equations, const double *sum, double count) {
    const size_t n = equations->unknowns;
    normal_equations_penalise(equations, sum, -1.0 / count);
    for (size_t u = 0; u < n; u++) {
        equations->moment[u] -= sum[u] * sum[n] / count;
    }
}

static void forget(normal_equations_t *equations, size_t unknown) {
    for (size_t u = 0; u < equations->unknowns; u++) {
        equations->gram[unknown * equations->unknowns + u] = 0.0;
        equations->gram[u * equations->unknowns + unknown] = 0.0;
    }
    equations->moment[unknown] = 0.0;
}

void refine_equations(const refine_problem_t *problem, normal_equations_t *equations) {
    const size_t n = problem->job->unknowns, recordings = problem->job->count;
    double *step = allocate(n, sizeof(double)), *effect_um = allocate(n, sizeof(double)),
           *sum = allocate(recordings * (n + 1), sizeof(double));
    normal_equations_create(equations, n);
    for (size_t u = 0; u < n; u++) {
        step[u] = difference_step(problem, u);
    }
    for (size_t i = 0; i < recordings; i++) {
        walk_t walk = {
            .problem = problem, .recording = i, .step = step, .effect_um = effect_um, .sum = sum + i * (n + 1)};
        add_recording(&walk, equations);
    }
    normal_equations_finish(equations);
    for (size_t i = 0; i < recordings && problem->job->offsets; i++) {
        if (problem->to[i] > problem->from[i]) {
            take_out_means(equations, sum + i * (n + 1), (double)(problem->to[i] - problem->from[i]));
        }
    }
    for (size_t u = 0; u < n; u++) {
        if (!(effect_um[u] > rounding * problem->largest_um && isfinite(effect_um[u]))) {
            forget(equations, u);
        }
    }
    free(step);
    free(effect_um);
    free(sum);
}
