/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "identify/refine_problem.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

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

chain_stream_t refine_stream(const refine_problem_t *problem, size_t i, size_t first) {
    stage_setup_t setup = {.sample_rate_hz = problem->job->recordings[i].sample_rate_hz,
                           .preload_n = problem->preload_n[i],
                           .clock_s = problem->job->recordings[i].clock_s};
    failure_t ignored; /* chain_determined_from has read it */
    chain_between_samples(&problem->job->recordings[i], &setup);
    (void)recording_drive_before(&problem->job->recordings[i], setup.before_v, &setup.befores, &ignored);
    return chain_stream_open(problem->model, first, &setup);
}

bool refine_residual(const refine_problem_t *problem, size_t i, double *residual, double *offset_um) {
    const recording_t *recording = &problem->job->recordings[i];
    const size_t from = problem->from[i], to = problem->to[i];
    chain_stream_t chain = refine_stream(problem, i, 0);
    stream_piece_t piece;
    double sum = 0.0;
    chain_stream_settle(&chain, (signal_t){.value = recording->column[COLUMN_DRIVE][0]}, NULL);
    for (size_t start = 0, k = 0; k < to; start += piece.count) {
        chain_stream_fill(&chain, recording, start, to, &piece);
        chain_stream_run(&chain, piece.signal, piece.count, piece.ends, NULL);
        for (size_t j = 0; j < chain.out && k < to; j++, k++) {
            if (k >= from) {
                residual[k - from] = recording->column[COLUMN_DISPLACEMENT][k] - chain.signal[j].value;
                sum += residual[k - from];
            }
        }
    }
    chain_stream_close(&chain);
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
