/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "identify/initial_memory.h"
#include "numerics/simplex.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { PAST = 3 /* rest, first extreme, second extreme */, GRID = 7, MOST_SAMPLES = 400, MOST_ITERATIONS = 200 };

/*
 * A chain of play steps is a clamp of the initial memory, and the clamp's limits come from starting at plus and at
 * minus infinity. So the recording is walked twice, and every trial past costs only the samples that were kept.
 */
typedef struct {
    const play_basis_t *basis;
    const linear_fit_t *fit;
    double first_v;
    size_t past; /* drives of a past */
    size_t samples;
    double *low_v, *high_v; /* samples by operators */
    double *rest_um;        /* displacement less offset less direct part */
    double *memory_v;
} search_t;

static void memory_of_past(const play_basis_t *basis, const double *past_v, size_t past, double first_v,
                           double *memory_v) {
    for (size_t i = 0; i < basis->operators; i++) {
        const double r = basis->threshold_v[i];
        double z = past_v[0];
        for (size_t p = 1; p < past; p++) {
            z = fmax(past_v[p] - r, fmin(past_v[p] + r, z));
        }
        memory_v[i] = fmax(first_v - r, fmin(first_v + r, z));
    }
}

static double mean_error(const double *past_v, void *context) {
    const search_t *search = context;
    const size_t n = search->basis->operators;
    double sum = 0.0;
    memory_of_past(search->basis, past_v, search->past, search->first_v, search->memory_v);
    for (size_t s = 0; s < search->samples; s++) {
        const double *low = search->low_v + s * n, *high = search->high_v + s * n;
        double error = search->rest_um[s];
        for (size_t i = 0; i < n; i++) {
            error -= search->fit->weight[i + 1] * fmax(low[i], fmin(high[i], search->memory_v[i]));
        }
        sum += fabs(error);
    }
    return sum / (double)search->samples;
}

static void prepare(search_t *search, const recording_t *recording, size_t end) {
    const size_t n = search->basis->operators, stride = end / MOST_SAMPLES + 1;
    const size_t most = end / stride + 1;
    double *infinite = allocate(n, sizeof(double));
    play_walk_t low, high;
    search->first_v = recording->column[COLUMN_DRIVE][0];
    search->low_v = allocate(most * n, sizeof(double));
    search->high_v = allocate(most * n, sizeof(double));
    search->rest_um = allocate(most, sizeof(double));
    search->memory_v = allocate(n, sizeof(double));
    for (size_t i = 0; i < n; i++) {
        infinite[i] = -HUGE_VAL;
    }
    play_walk_begin(&low, search->basis, recording, infinite);
    for (size_t i = 0; i < n; i++) {
        infinite[i] = HUGE_VAL;
    }
    play_walk_begin(&high, search->basis, recording, infinite);
    for (size_t k = 0; k < end; k++) {
        play_walk_step(&low);
        play_walk_step(&high);
        if (k % stride == 0) {
            memcpy(search->low_v + search->samples * n, low.memory_v, n * sizeof(double));
            memcpy(search->high_v + search->samples * n, high.memory_v, n * sizeof(double));
            search->rest_um[search->samples++] = recording->column[COLUMN_DISPLACEMENT][k] - search->fit->offset_um -
                                                 search->fit->weight[0] * recording->column[COLUMN_DRIVE][k];
        }
    }
    play_walk_end(&low);
    play_walk_end(&high);
    free(infinite);
}

static void drive_range(const recording_t *recording, double *low, double *high) {
    *low = *high = recording->column[COLUMN_DRIVE][0];
    for (size_t k = 1; k < recording->samples; k++) {
        *low = fmin(*low, recording->column[COLUMN_DRIVE][k]);
        *high = fmax(*high, recording->column[COLUMN_DRIVE][k]);
    }
}

/* Best point of a coarse grid over the past. The rest may also be 0 V: a new actuator. */
static void search_grid(search_t *search, double low, double high, double best_v[PAST]) {
    double least = HUGE_VAL;
    for (int a = 0; a <= GRID; a++) {
        for (int b = 0; b < GRID; b++) {
            for (int c = 0; c < GRID; c++) {
                const double past_v[PAST] = {a == GRID ? 0.0 : low + (high - low) * a / (GRID - 1),
                                             low + (high - low) * b / (GRID - 1), low + (high - low) * c / (GRID - 1)};
                const double error = mean_error(past_v, search);
                if (error < least) {
                    least = error;
                    memcpy(best_v, past_v, sizeof past_v);
                }
            }
        }
    }
}

double estimate_initial_memory(const play_basis_t *basis, const linear_fit_t *fit, const recording_t *recording,
                               size_t end, double *memory_v) {
    search_t search = {.basis = basis, .fit = fit, .past = PAST};
    double low, high, past_v[PAST] = {0.0}, before_v[RECORDING_MOST_BEFORE], error;
    size_t befores;
    failure_t ignored;
    if (end == 0) { /* nothing depends on it */
        end = 1;
    }
    prepare(&search, recording, end);
    if (recording_drive_before(recording, before_v, &befores, &ignored) && befores > 0) { /* it is known */
        search.past = befores;
        error = mean_error(before_v, &search);
        memory_of_past(basis, before_v, befores, search.first_v, memory_v);
    } else {
        drive_range(recording, &low, &high);
        search_grid(&search, low, high, past_v);
        const simplex_job_t job = {.function = mean_error,
                                   .context = &search,
                                   .dimensions = PAST,
                                   .step = 0.5 * (high - low) / (GRID - 1),
                                   .size = 1e-5 * (high - low),
                                   .most_iterations = MOST_ITERATIONS};
        error = simplex_minimise(&job, past_v);
        memory_of_past(basis, past_v, PAST, search.first_v, memory_v);
    }
    free(search.low_v);
    free(search.high_v);
    free(search.rest_um);
    free(search.memory_v);
    return error;
}
