/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The simulation estimate of recursion_fit.h. */
#include "identify/recursion_fit.h"
#include "identify/recursion_rows.h"
#include "numerics/least_squares.h"
#include "numerics/simplex.h"
#include <gsl/gsl_math.h>
#include <stdlib.h>
#include <string.h>

enum {
    NONLINEAR = RECURSION_FEEDBACK + RECURSION_FIT_SHAPES + 1,
    MOST_ITERATIONS = 200, /* of a search of three or four numbers */
    MOST_WITH_SHAPES = 800,
    MOST_KEPT = 1 << 23 /* elements of rows: 64 MiB */
};
/* Decay of the initial transient before the first sample included, as a power of e. */
static const double forgotten = 5.0;
/* The direct weight of the drive is at least this fraction of the others, because the inverse divides by it. The
 * response of the harmonics to the last drive is at most this fraction of it, because the inverse feeds its last drive
 * back through them. */
static const double invertible_share = 0.1, most_harmonics = 0.8;
/* The search's scale of the bilinear gain, which is small. */
static const double bilinear_scale = 0.01;

static double share(const recursion_problem_t *problem) {
    return problem->invertible ? invertible_share : 0.0;
}

/* The next row, with a share of the drive in every other column: weights of 0 and more then keep that of the drive
 * above it. */
static void step_shared(recursion_rows_t *rows, double *row) {
    const double least_direct = share(rows->problem);
    recursion_rows_step(rows, row);
    for (size_t i = 1; i < rows->problem->basis.columns; i++) {
        row[i] += least_direct * row[0];
    }
}

/* The direct weight of the drive, including its share in the other columns. */
static double direct_weight(const recursion_problem_t *problem, const double *x) {
    double direct = x[0];
    for (size_t i = 1; i < problem->basis.columns; i++) {
        direct += share(problem) * x[i];
    }
    return direct;
}

typedef struct {
    const recursion_problem_t *problem;
    bool bilinear;
    double lower[RECURSION_ROW];
    double shrink; /* roots have to be inside the circle of 1 / shrink */
    double *past;  /* three filtered rows */
    double *kept;  /* of all samples, where no shape changes them and they are not too many; else NULL */
    recursion_estimate_t *estimate;
    failure_t *failure;
    double evaluations, most_evaluations;
} search_t;

/* Coefficients of a polynomial with its roots inside the unit circle, from numbers without bounds: the reflection
 * coefficients' inverse hyperbolic tangents (Levinson's recursion), and back. */
static void feedback_from_reflections(const double *x, double feedback[RECURSION_FEEDBACK]) {
    double a[RECURSION_FEEDBACK] = {0.0};
    for (size_t n = 0; n < RECURSION_FEEDBACK; n++) {
        const double reflection = tanh(x[n]);
        double next[RECURSION_FEEDBACK] = {0.0};
        for (size_t i = 0; i < n; i++) {
            next[i] = a[i] + reflection * a[n - 1 - i];
        }
        next[n] = reflection;
        memcpy(a, next, sizeof a);
    }
    for (size_t i = 0; i < RECURSION_FEEDBACK; i++) {
        feedback[i] = -a[i];
    }
}

static void reflections_from_feedback(const double feedback[RECURSION_FEEDBACK], double *x) {
    double a[RECURSION_FEEDBACK];
    for (size_t i = 0; i < RECURSION_FEEDBACK; i++) {
        a[i] = -feedback[i];
    }
    for (size_t n = RECURSION_FEEDBACK; n-- > 0;) {
        const double reflection = a[n];
        double previous[RECURSION_FEEDBACK] = {0.0};
        for (size_t i = 0; i < n; i++) {
            previous[i] = (a[i] - reflection * a[n - 1 - i]) / (1.0 - reflection * reflection);
        }
        memcpy(a, previous, sizeof a);
        x[n] = atanh(reflection);
    }
}

/* The roots are inside the circle of 1 / factor for every drive at rest. */
static bool decays(const double feedback[RECURSION_FEEDBACK], double bilinear, double factor) {
    double grown[RECURSION_FEEDBACK], power = 1.0;
    for (size_t i = 0; i < RECURSION_FEEDBACK; i++) {
        power *= factor;
        grown[i] = feedback[i] * power;
    }
    return recursion_margin(grown, bilinear * factor) > 0.0;
}

/* Largest gain of the harmonics for a change of the last drive: the slopes of u, u^3 and u^5 at u = 1. */
static double harmonics_slope(const double harmonic[RECURSION_HARMONICS]) {
    return hypot(harmonic[0], harmonic[3]) + 3.0 * hypot(harmonic[1], harmonic[4]) +
           5.0 * hypot(harmonic[2], harmonic[5]);
}

/* Solves, and shrinks the harmonics until the inverse is stable. */
static bool solve_invertible(const search_t *search, normal_equations_t *equations, double *x, double *rms) {
    const size_t columns = search->problem->basis.columns;
    double *const harmonic = x + columns;
    double pull = 1e-9 * equations->power, pulled = 0.0;
    for (;;) {
        double part = 0.0, unit[RECURSION_ROW] = {0.0};
        if (!solve_bounded(equations, search->lower, x, NULL, search->failure)) {
            return false;
        }
        const double direct = direct_weight(search->problem, x);
        for (size_t i = 0; i < RECURSION_HARMONICS; i++) {
            part += gsl_pow_2((double)(2 * (i % 3) + 1) * harmonic[i]);
        }
        if (!search->problem->invertible) {
            *rms = sqrt(squared_error(equations, x) / (double)equations->rows);
            return true;
        }
        /* Without any weight on the drive there is nothing to be inverted, and nothing to compare with. */
        if (harmonics_slope(harmonic) <= most_harmonics * direct || !(part > 0.0) || pull > 1e9 * equations->power) {
            *rms = sqrt(fmax(squared_error(equations, x) - pulled * part, 0.0) / (double)equations->rows);
            return true;
        }
        for (size_t i = 0; i < RECURSION_HARMONICS; i++) {
            unit[columns + i] = (double)(2 * (i % 3) + 1);
            normal_equations_penalise(equations, unit, pull);
            unit[columns + i] = 0.0;
        }
        pulled += pull;
        pull *= 10.0;
    }
}

/* The best linear parameters for x: feedback, shapes, bilinear gain. Returns the RMS error; HUGE_VAL where x is not
 * allowed. */
static double solve_for(const double *x, void *context) {
    search_t *search = context;
    const recursion_problem_t *problem = search->problem;
    recursion_estimate_t *estimate = search->estimate;
    const size_t n = problem->basis.columns + RECURSION_AFTER, shapes = problem->basis.shapes;
    const double *y = problem->recording->column[COLUMN_DISPLACEMENT];
    double row[RECURSION_ROW], solution[RECURSION_ROW], *past = search->past;
    normal_equations_t equations;
    double rms = HUGE_VAL;
    progress_update(problem->progress, search->evaluations++ / search->most_evaluations);
    feedback_from_reflections(x, estimate->feedback);
    memcpy(estimate->shape, x + RECURSION_FEEDBACK, shapes * sizeof(double));
    estimate->bilinear = search->bilinear ? bilinear_scale * x[RECURSION_FEEDBACK + shapes] : 0.0;
    if (!decays(estimate->feedback, estimate->bilinear, search->shrink)) {
        return HUGE_VAL;
    }
    memset(past, 0, RECURSION_FEEDBACK * n * sizeof(double));
    normal_equations_create(&equations, n);
    recursion_rows_t rows = recursion_rows_begin(problem, estimate->shape);
    for (size_t k = 0; k < problem->to; k++) {
        const double *c = estimate->feedback, bend = c[0] + estimate->bilinear * recursion_input_before(problem, k);
        const double *own = search->kept != NULL ? search->kept + k * n : row;
        double *newest = past + k % RECURSION_FEEDBACK * n; /* overwrites the oldest, in place */
        const double *last = past + (k + 2) % RECURSION_FEEDBACK * n, *before = past + (k + 1) % RECURSION_FEEDBACK * n;
        if (search->kept == NULL) {
            step_shared(&rows, row);
        }
        for (size_t i = 0; i < n; i++) {
            newest[i] = own[i] + bend * last[i] + c[1] * before[i] + c[2] * newest[i];
        }
        if (k >= problem->from) {
            normal_equations_add(&equations, newest, y[k]);
        }
    }
    normal_equations_finish(&equations);
    if (solve_invertible(search, &equations, solution, &rms)) {
        recursion_take(problem, solution, estimate);
        estimate->weight[0] = direct_weight(problem, solution);
    }
    normal_equations_free(&equations);
    return rms;
}

/* Brings the roots into the circle. */
static void calm(const search_t *search, recursion_estimate_t *estimate) {
    double *c = estimate->feedback;
    const double by = 0.98;
    estimate->bilinear = search->bilinear ? estimate->bilinear : 0.0;
    while (!decays(c, estimate->bilinear, search->shrink)) {
        c[0] *= by;
        c[1] *= by * by;
        c[2] *= by * by * by;
        estimate->bilinear *= by * by;
    }
}

static void to_search(const search_t *search, recursion_estimate_t *start, double *x) {
    const size_t shapes = search->problem->basis.shapes;
    calm(search, start);
    reflections_from_feedback(start->feedback, x);
    memcpy(x + RECURSION_FEEDBACK, start->shape, shapes * sizeof(double));
    x[RECURSION_FEEDBACK + shapes] = start->bilinear / bilinear_scale;
}

static size_t most_iterations(const recursion_problem_t *problem) {
    return problem->basis.shapes > 0 ? MOST_WITH_SHAPES : MOST_ITERATIONS;
}

static double search_from(search_t *search, recursion_estimate_t start, recursion_estimate_t *best, double least) {
    const size_t shapes = search->problem->basis.shapes;
    double x[NONLINEAR];
    to_search(search, &start, x);
    const simplex_job_t job = {.function = solve_for,
                               .context = search,
                               .dimensions = RECURSION_FEEDBACK + shapes + (search->bilinear ? 1 : 0),
                               .step = 0.2,
                               .size = 1e-3,
                               .most_iterations = most_iterations(search->problem)};
    simplex_minimise(&job, x);
    const double rms = solve_for(x, search);
    if (rms < least) {
        *best = *search->estimate;
        return rms;
    }
    return least;
}

/* The most promising of a few dozen recursions: a mode and a lag behind it. */
static void scan(search_t *search, recursion_estimate_t *start) {
    static const double angles[] = {0.02, 0.04, 0.06, 0.08, 0.1, 0.13, 0.18, 0.25, 0.4, 0.8}; /* rad a sample */
    static const double radii[] = {0.9, 0.98, 0.993}, lags[] = {0.0, 0.5, 0.8};
    const recursion_estimate_t base = *start;
    double least = HUGE_VAL, x[NONLINEAR];
    for (size_t i = 0; i < sizeof angles / sizeof angles[0]; i++) {
        for (size_t r = 0; r < sizeof radii / sizeof radii[0]; r++) {
            for (size_t l = 0; l < sizeof lags / sizeof lags[0]; l++) {
                const double twice = 2.0 * radii[r] * cos(angles[i]), square = radii[r] * radii[r];
                recursion_estimate_t candidate = base;
                candidate.feedback[0] = twice + lags[l];
                candidate.feedback[1] = -square - lags[l] * twice;
                candidate.feedback[2] = lags[l] * square;
                candidate.bilinear = 0.0;
                to_search(search, &candidate, x);
                const double rms = solve_for(x, search);
                if (rms < least) {
                    least = rms;
                    *start = candidate;
                }
            }
        }
    }
}

bool recursion_fit_simulation(const recursion_problem_t *problem, recursion_estimate_t *estimate, failure_t *failure) {
    recursion_estimate_t work = {0}, one_step, scanned;
    search_t search = {.problem = problem,
                       .shrink = exp(forgotten / (double)problem->from),
                       .estimate = &work,
                       .failure = failure,
                       .most_evaluations = 90.0 + (problem->bilinear ? 4.0 : 2.0) * (double)most_iterations(problem)};
    const size_t n = problem->basis.columns + RECURSION_AFTER;
    double least = HUGE_VAL;
    if (!recursion_fit_one_step(problem, &one_step, failure)) {
        return false;
    }
    for (size_t i = 0; i < n; i++) {
        search.lower[i] = problem->invertible && i < problem->basis.columns ? problem->basis.lower[i] : -HUGE_VAL;
    }
    search.past = allocate(RECURSION_FEEDBACK * n, sizeof(double));
    if (problem->basis.shapes == 0 && problem->to * n <= MOST_KEPT) {
        recursion_rows_t rows = recursion_rows_begin(problem, one_step.shape);
        search.kept = allocate(problem->to * n, sizeof(double));
        for (size_t k = 0; k < problem->to; k++) {
            step_shared(&rows, search.kept + k * n);
        }
    }
    scanned = one_step;
    scan(&search, &scanned);
    least = search_from(&search, one_step, estimate, least);
    least = search_from(&search, scanned, estimate, least);
    if (problem->bilinear) {
        const recursion_estimate_t without = *estimate;
        search.bilinear = true;
        least = search_from(&search, one_step, estimate, least);
        least = search_from(&search, without, estimate, least);
    }
    free(search.past);
    free(search.kept);
    if (!isfinite(least)) {
        return fail(failure, "%s: no stable recursion comes near the displacement", problem->recording->name);
    }
    recursion_judge(problem, estimate);
    return true;
}
