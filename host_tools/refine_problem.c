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

/* Signals are taken through the chain in pieces, so that memory does not grow with the recording. A stage
 * looks ahead, so each one is behind the stage before it until the recording ends. */
enum { PIECE = 512, MOST = PIECE + SIGNAL_AHEAD * MODEL_MAX_BLOCKS };

/* What comes in at a stage with a piece. */
typedef struct {
    signal_t signal[MOST];
    size_t count;
} piece_t;

/* A chain from one stage on, with the numbers that the model had when it was opened. */
typedef struct {
    size_t first, stages;
    chain_stage_t stage[MODEL_MAX_BLOCKS];
    signal_t *signal;                /* on their way: MOST of them at most */
    size_t count, out;               /* how many; of these, through all stages: they go with the next piece */
    size_t seen[MODEL_MAX_BLOCKS];   /* of these, by each stage, */
    size_t passed[MODEL_MAX_BLOCKS]; /* and through it */
} tail_t;

static tail_t tail_open(const refine_problem_t *problem, size_t recording, size_t first) {
    const stage_setup_t setup = {.sample_rate_hz = problem->job->recordings[recording].sample_rate_hz,
                                 .preload_n = problem->preload_n[recording]};
    tail_t tail = {.first = first, .stages = problem->stages, .signal = allocate(MOST, sizeof(signal_t))};
    for (size_t stage = first; stage < problem->stages; stage++) {
        tail.stage[stage] = chain_stage_open(problem->model, problem->order[stage], &setup);
    }
    return tail;
}

static void tail_close(tail_t *tail) {
    for (size_t stage = tail->first; stage < tail->stages; stage++) {
        chain_stage_close(&tail->stage[stage]);
    }
    free(tail->signal);
}

/* input, unless NULL, gets what enters each stage. */
static void tail_settle(const tail_t *tail, signal_t *signal, signal_t *input) {
    for (size_t stage = tail->first; stage < tail->stages; stage++) {
        if (input != NULL) {
            input[stage] = *signal;
        }
        chain_stage_settle(&tail->stage[stage], signal);
    }
}

static void tail_forget(tail_t *tail) {
    tail->count -= tail->out;
    memmove(tail->signal, tail->signal + tail->out, tail->count * sizeof(signal_t));
    for (size_t stage = tail->first; stage < tail->stages; stage++) {
        tail->seen[stage] -= tail->out;
        tail->passed[stage] -= tail->out;
    }
    tail->out = 0;
}

/* ends: nothing follows. input, unless NULL, gets what comes in at each stage. Afterwards tail->out positions are at
 * tail->signal. */
static void tail_run(tail_t *tail, const signal_t *signal, size_t count, bool ends, piece_t *input) {
    tail_forget(tail);
    memcpy(tail->signal + tail->count, signal, count * sizeof *signal);
    tail->count += count;
    tail->out = tail->count;
    for (size_t stage = tail->first; stage < tail->stages; stage++) {
        const size_t seen = tail->seen[stage], passed = tail->passed[stage];
        if (input != NULL) {
            input[stage].count = tail->out - seen;
            memcpy(input[stage].signal, tail->signal + seen, input[stage].count * sizeof *signal);
        }
        tail->seen[stage] = tail->out;
        tail->out -= ends ? 0 : SIGNAL_AHEAD;
        chain_stage_run(&tail->stage[stage], tail->signal + passed, tail->out - passed, tail->seen[stage] - passed);
        tail->passed[stage] = tail->out;
    }
}

/* The drive from sample `start` on, a piece of it, as far as the stages look ahead together. */
static size_t fill_drive(const refine_problem_t *problem, size_t recording, size_t start, signal_t *signal,
                         bool *ends) {
    const recording_t *r = &problem->job->recordings[recording];
    const size_t wanted = problem->to[recording] + SIGNAL_AHEAD * problem->stages;
    const size_t left = (wanted < r->samples ? wanted : r->samples) - start, count = left < PIECE ? left : PIECE;
    for (size_t k = 0; k < count; k++) {
        signal[k] = (signal_t){.value = r->column[COLUMN_DRIVE][start + k]};
    }
    *ends = start + count == r->samples;
    return count;
}

bool refine_residual(const refine_problem_t *problem, size_t i, double *residual, double *offset_um) {
    const recording_t *recording = &problem->job->recordings[i];
    const size_t from = problem->from[i], to = problem->to[i];
    tail_t chain = tail_open(problem, i, 0);
    signal_t signal[PIECE], settled = {.value = recording->column[COLUMN_DRIVE][0]};
    double sum = 0.0;
    tail_settle(&chain, &settled, NULL);
    for (size_t start = 0, k = 0; k < to; start += PIECE) {
        bool ends;
        const size_t count = fill_drive(problem, i, start, signal, &ends);
        tail_run(&chain, signal, count, ends, NULL);
        for (size_t j = 0; j < chain.out && k < to; j++, k++) {
            if (k >= from) {
                residual[k - from] = recording->column[COLUMN_DISPLACEMENT][k] - chain.signal[j].value;
                sum += residual[k - from];
            }
        }
    }
    tail_close(&chain);
    *offset_um = problem->job->offsets && to > from ? sum / (double)(to - from) : 0.0;
    for (size_t k = 0; k < to - from; k++) {
        residual[k] -= *offset_um;
    }
    return isfinite(sum);
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
    double *effect_um;  /* an unknown: largest difference so far; HUGE_VAL: it ran away */
    tail_t chain, *moved;
    piece_t *input;      /* a stage */
    double *column;      /* an unknown: MOST derivatives */
    double *row, *first; /* of the sample; of the first one that counts, its residual behind it */
    double *sum;         /* an unknown, and the residual: of rows less the first one */
} walk_t;

static void walk_open(walk_t *walk) {
    const refine_problem_t *problem = walk->problem;
    const size_t n = problem->job->unknowns;
    signal_t settled = {.value = problem->job->recordings[walk->recording].column[COLUMN_DRIVE][0]};
    signal_t entered[MODEL_MAX_BLOCKS];
    walk->chain = tail_open(problem, walk->recording, 0);
    walk->moved = allocate(n, sizeof *walk->moved);
    walk->input = allocate(problem->stages, sizeof *walk->input);
    walk->column = allocate(n * MOST, sizeof(double));
    walk->row = allocate(n + 1, sizeof(double));
    walk->first = allocate(n + 1, sizeof(double));
    tail_settle(&walk->chain, &settled, entered);
    for (size_t u = 0; u < n; u++) {
        const size_t first = walk->step[u] != 0.0 ? stage_of(problem, u) : problem->stages;
        const double value = *refine_value(problem, u);
        if (walk->step[u] != 0.0) {
            refine_set(problem, u, refine_get(problem, u) + walk->step[u]);
        }
        walk->moved[u] = tail_open(problem, walk->recording, first);
        *refine_value(problem, u) = value;
        if (walk->step[u] != 0.0) {
            settled = entered[first];
            tail_settle(&walk->moved[u], &settled, NULL);
        }
    }
}

static void walk_close(walk_t *walk) {
    for (size_t u = 0; u < walk->problem->job->unknowns; u++) {
        tail_close(&walk->moved[u]);
    }
    tail_close(&walk->chain);
    free(walk->moved);
    free(walk->input);
    free(walk->column);
    free(walk->row);
    free(walk->first);
}

/* Derivatives of the positions that the chain has given. */
static void fill_column(walk_t *walk, size_t unknown, bool ends) {
    tail_t *moved = &walk->moved[unknown];
    double *column = walk->column + unknown * MOST;
    if (walk->step[unknown] == 0.0) {
        return; /* stays 0, as if it had no effect */
    }
    tail_run(moved, walk->input[moved->first].signal, walk->input[moved->first].count, ends, NULL);
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
        walk->row[u] = walk->column[u * MOST + j];
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
    signal_t signal[PIECE];
    walk_open(walk);
    for (size_t start = 0, k = 0; k < to; start += PIECE) {
        bool ends;
        const size_t count = fill_drive(problem, walk->recording, start, signal, &ends);
        tail_run(&walk->chain, signal, count, ends, walk->input);
        for (size_t u = 0; u < problem->job->unknowns; u++) {
            fill_column(walk, u, ends);
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
