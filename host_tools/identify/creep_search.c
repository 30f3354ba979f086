/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "identify/creep_search.h"
#include "chain/catalogue.h"
#include "numerics/golden_section.h"
#include <math.h>
#include <stdlib.h>

/* Piezo ceramics creep by 1 to 2 % a decade, 5 % at most; a wider search would fit other effects. */
static const double lowest_gamma = -0.02, highest_gamma = 0.08;
/* A minimum nearer to an end of the range than this does not count as inside. */
static const double range_end = 1e-4;
/* Shrinks the bracket to 1e-5 of its width and less. */
enum { STEPS = 24 };

void creep_remove(const creep_cells_t *cells, const double *position, size_t samples, double initial, double *elastic) {
    double level[CREEP_MAX_CELLS];
    creep_settle(cells, level, initial);
    for (size_t k = 0; k < samples; k++) {
        elastic[k] = position[k] - creep_offset(cells, level);
        creep_follow(cells, level, elastic[k]);
    }
}

void creep_apply(const creep_cells_t *cells, const double *elastic, size_t samples, double initial, double *position) {
    double level[CREEP_MAX_CELLS];
    creep_settle(cells, level, initial);
    for (size_t k = 0; k < samples; k++) {
        const double present = elastic[k];
        position[k] = present + creep_offset(cells, level);
        creep_follow(cells, level, present);
    }
}

double creep_initial(const creep_cells_t *cells, const recording_t *recording) {
    return recording->column[COLUMN_DISPLACEMENT][0] / creep_gain_at_rest(cells);
}

creep_cells_t creep_default_cells(double gamma_per_decade, double sample_rate_hz) {
    return creep_cells(gamma_per_decade, block_creep.parameter[1].default_value, block_creep.parameter[2].default_value,
                       sample_rate_hz);
}

recording_t *creep_recordings(const recording_t *recordings, size_t count, double gamma_per_decade) {
    recording_t *elastic = allocate(count, sizeof *elastic);
    for (size_t i = 0; i < count; i++) {
        const creep_cells_t cells = creep_default_cells(gamma_per_decade, recordings[i].sample_rate_hz);
        elastic[i] = recordings[i];
        elastic[i].column[COLUMN_DISPLACEMENT] = allocate(recordings[i].samples, sizeof(double));
        creep_remove(&cells, recordings[i].column[COLUMN_DISPLACEMENT], recordings[i].samples,
                     creep_initial(&cells, &recordings[i]), elastic[i].column[COLUMN_DISPLACEMENT]);
    }
    return elastic;
}

void creep_recordings_free(recording_t *elastic, size_t count) {
    for (size_t i = 0; i < count; i++) {
        free(elastic[i].column[COLUMN_DISPLACEMENT]); /* only the displacement is owned; the other members are shared */
    }
    free(elastic);
}

typedef struct {
    const recording_t *recordings;
    size_t count;
    creep_fit_t *fit;
    void *context;
    size_t samples; /* of the last fit */
    int tried;
    progress_t *progress;
} problem_t;

/* Mean squared residual of the best fit, in *mean_square. */
static bool evaluate(void *context, double gamma, double *mean_square) {
    problem_t *problem = context;
    recording_t *elastic = creep_recordings(problem->recordings, problem->count, gamma);
    const bool good = problem->fit(problem->context, elastic, mean_square, &problem->samples);
    creep_recordings_free(elastic, problem->count);
    progress_update(problem->progress, fmin((double)++problem->tried / STEPS, 1.0));
    return good;
}

/* From the curvature of the sum of squares at the minimum. */
static bool standard_error(problem_t *problem, double gamma, double *sigma) {
    const double step = 1e-3;
    double below, at, above;
    if (!evaluate(problem, gamma - step, &below) || !evaluate(problem, gamma, &at) ||
        !evaluate(problem, gamma + step, &above)) {
        return false;
    }
    const double curvature = (below - 2.0 * at + above) / (step * step);
    *sigma = curvature > 0.0 ? sqrt(2.0 * at / ((double)problem->samples * curvature)) : HUGE_VAL;
    return true;
}

bool creep_search(const recording_t *recordings, size_t count, creep_fit_t *fit, void *context,
                  double *gamma_per_decade, double *sigma, progress_t *progress) {
    problem_t problem = {
        .recordings = recordings, .count = count, .fit = fit, .context = context, .progress = progress};
    if (!golden_section(evaluate, &problem, lowest_gamma, highest_gamma, STEPS, gamma_per_decade)) {
        return false;
    }
    if (fmin(*gamma_per_decade - lowest_gamma, highest_gamma - *gamma_per_decade) < range_end) {
        *sigma = HUGE_VAL;
        return true;
    }
    return standard_error(&problem, *gamma_per_decade, sigma);
}
