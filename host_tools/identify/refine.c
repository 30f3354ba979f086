/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "identify/refine.h"
#include "identify/refine_problem.h"
#include "numerics/autocorrelation.h"
#include "numerics/gauss_newton.h"
#include <assert.h>
#include <gsl/gsl_eigen.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Newton's decrement, in squared standard errors, at which the search ends: the next step would be a thousandth of one.
 */
static const double close_enough = 1e-6;
/* With play operators the sum of squares is piecewise smooth. Its minimum may be a kink between two pieces, where the
 * normal equations predict too large a decrease. If no step reduces it there, a predicted step below one standard error
 * counts as converged. */
static const double close_at_kink = 1.0;
/* Of the power of the displacement; sums of squares below it are rounding. */
static const double rounding = 1e-24;
/* Levenberg-Marquardt: ten times more damping after a rejected step, ten times less after an accepted one. */
static const gauss_newton_tunables_t tunables = {.most_trials = 1000,
                                                 .worth = 1.0,
                                                 .shorten = 1.0,
                                                 .first_damping = 1e-3,
                                                 .raise_damping = 10.0,
                                                 .lower_damping = 0.1,
                                                 .least_damping = 1e-12,
                                                 .most_damping = 1e9};
/* Of the matrix of the columns scaled to unit length. Two columns that differ by 1e-5 of their length have it. */
static const double singular_eigenvalue = 1e-10;
/* Component of an unknown in a singular direction above which it counts as not determined. */
static const double singular_part = 0.05;

refine_unknown_t refine_unknown_at(const model_t *model, size_t block, size_t parameter, size_t element) {
    const parameter_info_t *info = &model->block[block].block->parameter[parameter];
    return (refine_unknown_t){.block = block,
                              .parameter = parameter,
                              .element = element,
                              .low = info->low,
                              .high = info->high,
                              .logarithmic = info->low > 0.0};
}

refine_unknown_t refine_unknown(const model_t *model, const char *block, const char *parameter, size_t element) {
    size_t b = 0, p = 0;
    while (b < model->blocks && strcmp(model->block[b].block->name, block) != 0) {
        b++;
    }
    assert(b < model->blocks);
    while (p < model->block[b].block->parameters && strcmp(model->block[b].block->parameter[p].name, parameter) != 0) {
        p++;
    }
    assert(p < model->block[b].block->parameters);
    return refine_unknown_at(model, b, p, element);
}

/* Fixes the unknowns that are on a bound and would go beyond it. */
static void find_bound(const refine_problem_t *problem, const normal_equations_t *equations, bool *bound) {
    for (size_t u = 0; u < problem->job->unknowns; u++) {
        const double x = refine_get(problem, u), wish = equations->moment[u];
        bound[u] = (x <= refine_low(problem, u) && wish < 0.0) || (x >= refine_high(problem, u) && wish > 0.0);
    }
}

/* The step of the damped equations, 0 for bound unknowns. */
static bool solve_damped(const normal_equations_t *equations, const bool *bound, double damping, double *step,
                         failure_t *failure) {
    const size_t n = equations->unknowns;
    normal_equations_t damped = *equations;
    double *zero = allocate(n, sizeof(double));
    bool good;
    damped.gram = allocate(n * n, sizeof(double));
    memcpy(damped.gram, equations->gram, n * n * sizeof(double));
    for (size_t u = 0; u < n; u++) {
        damped.gram[u * n + u] *= 1.0 + damping;
    }
    good = solve_free(&damped, bound, zero, step, failure);
    free(damped.gram);
    free(zero);
    return good;
}

/* The decrease of the sum of squares that the normal equations predict. */
static bool decrement(const normal_equations_t *equations, const bool *bound, double *promised, failure_t *failure) {
    double *step = allocate(equations->unknowns, sizeof(double));
    const bool good = solve_damped(equations, bound, 0.0, step, failure);
    *promised = 0.0;
    for (size_t u = 0; good && u < equations->unknowns; u++) {
        *promised += equations->moment[u] * step[u];
    }
    free(step);
    return good;
}

/* Where the search stands. */
typedef struct {
    const refine_problem_t *problem;
    refine_report_t *report;
    failure_t *failure;
    double freedom; /* samples less unknowns */
    normal_equations_t equations;
    bool *bound;
    double *start;   /* the unknowns at the point of linearisation */
    double promised; /* predicted decrease of the sum of squares */
    bool good;
} search_t;

static double near_enough(const search_t *s, double cost) {
    return close_enough * cost / s->freedom;
}

/* false: the search is done, or has failed. */
static bool linearise(void *context, double *cost) {
    search_t *s = context;
    normal_equations_free(&s->equations);
    refine_equations(s->problem, &s->equations);
    find_bound(s->problem, &s->equations, s->bound);
    for (size_t u = 0; u < s->problem->job->unknowns; u++) {
        s->start[u] = refine_get(s->problem, u);
    }
    s->good = decrement(&s->equations, s->bound, &s->promised, s->failure);
    s->report->converged = s->good && s->promised <= fmax(near_enough(s, *cost), rounding * s->problem->power);
    return s->good && !s->report->converged;
}

static bool solve(void *context, double damping, double *step) {
    const search_t *s = context;
    failure_t singular;
    return solve_damped(&s->equations, s->bound, damping, step, &singular);
}

static void set_unknowns(const search_t *s, const double *step, double part) {
    for (size_t u = 0; u < s->problem->job->unknowns; u++) {
        refine_set(s->problem, u,
                   fmin(fmax(s->start[u] + part * step[u], refine_low(s->problem, u)), refine_high(s->problem, u)));
    }
}

/* Takes the step, as far as the bounds let it. */
static double move(void *context, const double *step, double part) {
    const search_t *s = context;
    set_unknowns(s, step, part);
    return refine_cost(s->problem);
}

static void move_back(void *context, const double *step, double part) {
    (void)part;
    set_unknowns(context, step, 0.0);
}

/* If no step reduces the sum of squares, the predicted step must be below one standard error. */
static bool ends(void *context, bool improved, double before, double now) {
    search_t *s = context;
    const refine_job_t *job = s->problem->job;
    bool done = !s->good || s->report->converged;
    (void)improved;
    if (!done && before - now <= near_enough(s, now)) {
        s->report->converged = s->promised <= close_at_kink * now / s->freedom;
        done = true;
    }
    s->report->iterations += done ? 0 : 1;
    if (job->progress != NULL) {
        progress_update(job->progress, (double)s->report->iterations / (double)job->most_iterations);
    }
    return done;
}

static bool search(const refine_problem_t *problem, refine_report_t *report, failure_t *failure) {
    const refine_job_t *job = problem->job;
    double cost = refine_cost(problem);
    if (!isfinite(cost)) {
        return fail(failure, "the model runs away where the search starts");
    }
    search_t s = {.problem = problem,
                  .report = report,
                  .failure = failure,
                  .freedom = (double)(problem->samples - job->unknowns),
                  .bound = allocate(job->unknowns, sizeof(bool)),
                  .start = allocate(job->unknowns, sizeof(double)),
                  .good = true};
    const gauss_newton_problem_t steps = {&s, job->unknowns, linearise, solve, move, move_back, NULL, ends};
    gauss_newton_tunables_t tuned = tunables;
    tuned.most_iterations = job->most_iterations;
    if (gauss_newton(&steps, &tuned, &cost) == GAUSS_NEWTON_LIMIT && job->most_iterations > 0) {
        (void)linearise(&s, &cost); /* whether the last step led there */
        (void)ends(&s, false, cost, cost);
    }
    normal_equations_free(&s.equations);
    free(s.bound);
    free(s.start);
    return s.good;
}

/* Marks unknowns without any effect, and those that lie in a direction in which the sum of squares does not change. */
static void find_singular(const normal_equations_t *equations, refine_state_t *state) {
    const size_t n = equations->unknowns;
    gsl_matrix *scaled = gsl_matrix_alloc(n, n), *vectors = gsl_matrix_alloc(n, n);
    gsl_vector *values = gsl_vector_alloc(n);
    gsl_eigen_symmv_workspace *workspace = gsl_eigen_symmv_alloc(n);
    for (size_t i = 0; i < n; i++) {
        for (size_t j = 0; j < n; j++) {
            const double length = sqrt(equations->gram[i * n + i] * equations->gram[j * n + j]);
            const bool held = state[i] == REFINE_AT_BOUND || state[j] == REFINE_AT_BOUND || !(length > 0.0);
            gsl_matrix_set(scaled, i, j, held ? (i == j ? 1.0 : 0.0) : equations->gram[i * n + j] / length);
        }
        if (state[i] != REFINE_AT_BOUND && !(equations->gram[i * n + i] > 0.0)) {
            state[i] = REFINE_NOT_DETERMINED;
        }
    }
    gsl_eigen_symmv(scaled, values, vectors, workspace);
    for (size_t direction = 0; direction < n; direction++) {
        for (size_t i = 0; gsl_vector_get(values, direction) < singular_eigenvalue && i < n; i++) {
            if (fabs(gsl_matrix_get(vectors, i, direction)) > singular_part) {
                state[i] = REFINE_NOT_DETERMINED;
            }
        }
    }
    gsl_eigen_symmv_free(workspace);
    gsl_vector_free(values);
    gsl_matrix_free(vectors);
    gsl_matrix_free(scaled);
}

/* Largest standard error with which a parameter of this unit counts as determined. */
static double plausible(const refine_problem_t *problem, const char *unit) {
    return strcmp(unit, "V") == 0    ? problem->drive_v
           : strcmp(unit, "um") == 0 ? problem->stroke_um
           : strcmp(unit, "s") == 0  ? problem->duration_s
           : strcmp(unit, "Hz") == 0 ? 0.5 * recordings_fastest_hz(problem->job->recordings, problem->job->count)
                                     : HUGE_VAL;
}

/* Whether a standard error, in the coordinate of the search, is too large for the parameter to count as determined. */
static bool implausible(const refine_problem_t *problem, const normal_equations_t *equations, size_t unknown,
                        double sigma) {
    const refine_unknown_t *u = &problem->job->unknown[unknown];
    const char *unit = problem->model->block[u->block].block->parameter[u->parameter].unit;
    const double value_sigma = u->logarithmic ? sigma * *refine_value(problem, unknown) : sigma;
    const double effect_um =
        sqrt(equations->gram[unknown * (equations->unknowns + 1)] / (double)problem->samples); /* of a step of 1 */
    return value_sigma > 0.5 * (u->high - u->low) || value_sigma > plausible(problem, unit) ||
           (u->logarithmic && sigma > 1.0) || sigma * effect_um > problem->stroke_um;
}

static void take_errors(const refine_problem_t *problem, const normal_equations_t *equations, const double *inverse,
                        double scale, refine_report_t *report) {
    const size_t n = report->unknowns;
    for (size_t i = 0; i < n; i++) {
        const double sigma = scale * sqrt(inverse[i * (n + 1)]);
        if (report->state[i] == REFINE_DETERMINED && implausible(problem, equations, i, sigma)) {
            report->state[i] = REFINE_NOT_DETERMINED;
        }
        report->sigma[i] = report->state[i] == REFINE_NOT_DETERMINED ? HUGE_VAL
                           : problem->job->unknown[i].logarithmic    ? sigma * *refine_value(problem, i)
                                                                     : sigma;
        for (size_t j = 0; j < n; j++) {
            const double product = sqrt(inverse[i * (n + 1)] * inverse[j * (n + 1)]);
            report->correlation[i * n + j] = product > 0.0 ? inverse[i * n + j] / product : 0.0;
        }
    }
}

/* Residuals, offsets and their autocorrelation where the search ended. */
static bool measure(const refine_problem_t *problem, refine_report_t *report) {
    const size_t count = problem->job->count;
    residual_run_t *run = allocate(count, sizeof *run);
    double **residual = allocate(count, sizeof *residual), square_sum = 0.0;
    bool good = true;
    for (size_t i = 0; i < count; i++) {
        const size_t samples = problem->to[i] - problem->from[i];
        residual[i] = allocate(samples, sizeof(double));
        good = refine_residual(problem, i, residual[i], &report->offset_um[i]) && good;
        run[i] = (residual_run_t){.value = residual[i], .samples = samples};
        for (size_t k = 0; k < samples; k++) {
            square_sum += residual[i][k] * residual[i][k];
        }
    }
    report->samples = problem->samples;
    report->rms_um = sqrt(square_sum / (double)problem->samples);
    report->autocorrelation_samples = autocorrelation_time(run, count);
    for (size_t i = 0; i < count; i++) {
        free(residual[i]);
    }
    free(residual);
    free(run);
    return good;
}

static bool find_errors(const refine_problem_t *problem, refine_report_t *report, failure_t *failure) {
    const size_t n = report->unknowns, spent = n + (problem->job->offsets ? problem->job->count : 0);
    double *inverse = allocate(n * n, sizeof(double));
    bool *bound = allocate(n, sizeof(bool));
    normal_equations_t equations;
    bool good;
    refine_equations(problem, &equations);
    find_bound(problem, &equations, bound);
    for (size_t i = 0; i < n; i++) {
        report->state[i] = bound[i] ? REFINE_AT_BOUND : REFINE_DETERMINED;
    }
    find_singular(&equations, report->state);
    good = inverse_matrix(&equations, bound, inverse, failure);
    if (good) {
        take_errors(problem, &equations, inverse,
                    report->rms_um * sqrt((double)problem->samples / (double)(problem->samples - spent) *
                                          report->autocorrelation_samples),
                    report);
    }
    normal_equations_free(&equations);
    free(bound);
    free(inverse);
    return good;
}

bool refine(model_t *model, const refine_job_t *job, refine_report_t *report, failure_t *failure) {
    const size_t n = job->unknowns;
    double *start = allocate(n, sizeof(double));
    refine_problem_t problem;
    bool opened, good;
    *report = (refine_report_t){.unknowns = n,
                                .state = allocate(n, sizeof *report->state),
                                .sigma = allocate(n, sizeof(double)),
                                .correlation = allocate(n * n, sizeof(double)),
                                .offset_um = allocate(job->count, sizeof(double)),
                                .converged = job->most_iterations == 0};
    opened = refine_problem_open(&problem, model, job, failure);
    for (size_t u = 0; u < n; u++) {
        start[u] = *refine_value(&problem, u);
    }
    good = opened && search(&problem, report, failure) &&
           (measure(&problem, report) || fail(failure, "the refined model runs away")) &&
           find_errors(&problem, report, failure);
    if (!good) {
        for (size_t u = 0; u < n; u++) {
            *refine_value(&problem, u) = start[u];
        }
        refine_report_free(report);
    }
    refine_problem_free(&problem);
    free(start);
    return good;
}

void refine_keep_errors(model_t *model, const refine_job_t *job, const refine_report_t *report) {
    for (size_t b = 0; b < model->blocks; b++) {
        for (size_t p = 0; p < model->block[b].block->parameters; p++) {
            parameter_t *parameter = &model->block[b].parameter[p];
            const bool known = parameter->sigma != NULL;
            for (size_t u = 0; u < job->unknowns && !known; u++) {
                if (job->unknown[u].block == b && job->unknown[u].parameter == p) {
                    if (parameter->sigma == NULL) {
                        parameter->sigma = allocate(parameter->count, sizeof(double));
                    }
                    parameter->sigma[job->unknown[u].element] = report->sigma[u];
                }
            }
        }
    }
}

void refine_report_free(refine_report_t *report) {
    free(report->state);
    free(report->sigma);
    free(report->correlation);
    free(report->offset_um);
    memset(report, 0, sizeof *report);
}
