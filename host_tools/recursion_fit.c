/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "recursion_fit.h"
#include "least_squares.h"
#include "simplex.h"
#include <gsl/gsl_math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    AFTER = RECURSION_HARMONICS + 1,                              /* harmonics and offset, behind the columns */
    ROW = RECURSION_FIT_COLUMNS + AFTER + RECURSION_FEEDBACK + 1, /* and last positions, and the bilinear term */
    NONLINEAR = RECURSION_FEEDBACK + RECURSION_FIT_SHAPES + 1,
    MOST_SAMPLES = 6000,
    MOST_WARM_UP = 3000,
    MOST_ITERATIONS = 200,
    MOST_KEPT = 1 << 23 /* elements of rows: 64 MiB */
};
/* What may be left of the drive besides its sine, of its amplitude. */
static const double drive_left = 0.02;
/* What is left of the start when the first sample counts, as a power of e. */
static const double forgotten = 5.0;
/* The drive's own weight is at least this part of the others: the inverse divides by it. And the harmonics may answer
 * to the last drive with this part of it: the inverse feeds its own last drive back through them. */
static const double least_direct = 0.1, most_harmonics = 0.8;
/* The search's scale of the bilinear gain, which is small. */
static const double bilinear_scale = 0.01;

bool recursion_problem(const family_job_t *job, const char *family, recursion_problem_t *problem, failure_t *failure) {
    const recording_t *recording = &job->recordings[0];
    const size_t train_to = job->train_to[0];
    memset(problem, 0, sizeof *problem);
    problem->recording = recording;
    problem->progress = job->progress;
    if (job->count != 1) {
        return fail(failure, "family %s needs one recording: its numbers belong to one frequency", family);
    }
    if (!sine_fit(recording->column[COLUMN_DRIVE], train_to, recording->sample_rate_hz, &problem->drive, failure)) {
        return fail_in(failure, "%s: family %s needs a sinusoidal drive", recording->name, family);
    }
    if (!(problem->drive.rms <= drive_left * problem->drive.amplitude)) {
        return fail(failure,
                    "%s: family %s needs a sinusoidal drive; %.2g %% of this one's amplitude is no sine of %.6g Hz",
                    recording->name, family, 100.0 * problem->drive.rms / problem->drive.amplitude,
                    problem->drive.frequency_hz);
    }
    const double period = recording->sample_rate_hz / problem->drive.frequency_hz;
    problem->from = (size_t)fmax(ceil(period), fmin(MOST_WARM_UP, floor((double)train_to / 3.0)));
    problem->to = (size_t)fmin((double)train_to, (double)problem->from + fmax(MOST_SAMPLES, 2.0 * period));
    if ((double)(problem->to - problem->from) < 0.99 * period || problem->from >= train_to) {
        return fail(failure, "%s: family %s needs two periods; the training part has %.2g of its %.6g Hz",
                    recording->name, family, (double)train_to / period, problem->drive.frequency_hz);
    }
    return true;
}

/* Goes along the recording and gives the row of each sample: columns, harmonics, 1. */
typedef struct {
    const recursion_problem_t *problem;
    size_t sample;
    double angle_step;
} walk_t;

/* u of the sample before k; what stands before the first is taken as equal to it. */
static double input_before(const recursion_problem_t *problem, size_t k) {
    const double drive = problem->recording->column[COLUMN_DRIVE][k > 0 ? k - 1 : 0];
    return (drive - problem->drive.offset) / problem->drive.amplitude;
}

static walk_t walk_begin(const recursion_problem_t *problem, const double *shape) {
    problem->basis.open(problem->basis.state, shape);
    return (walk_t){.problem = problem,
                    .angle_step = 2.0 * M_PI * problem->drive.frequency_hz / problem->recording->sample_rate_hz};
}

static void walk_step(walk_t *walk, double *row) {
    const recursion_problem_t *problem = walk->problem;
    const size_t columns = problem->basis.columns;
    const double angle = problem->drive.phase + walk->angle_step * ((double)walk->sample - 1.0);
    recursion_harmonics(input_before(problem, walk->sample), angle, row + columns);
    row[columns + RECURSION_HARMONICS] = 1.0;
    problem->basis.step(problem->basis.state, input_before(problem, ++walk->sample), row);
}

/* The same with least_direct of the drive in every other column. */
static void walk_step_shared(walk_t *walk, double *row) {
    walk_step(walk, row);
    for (size_t i = 1; i < walk->problem->basis.columns; i++) {
        row[i] += least_direct * row[0];
    }
}

static double predict(const recursion_estimate_t *estimate, size_t columns, const double *row) {
    double sum = estimate->offset_um;
    for (size_t i = 0; i < columns; i++) {
        sum += estimate->weight[i] * row[i];
    }
    for (size_t i = 0; i < RECURSION_HARMONICS; i++) {
        sum += estimate->harmonic[i] * row[columns + i];
    }
    return sum;
}

/* Sets both errors. */
static void judge(const recursion_problem_t *problem, recursion_estimate_t *estimate) {
    const double *y = problem->recording->column[COLUMN_DISPLACEMENT], *c = estimate->feedback;
    double row[ROW], past[RECURSION_FEEDBACK] = {0.0}, one_step = 0.0, simulated = 0.0, power = 0.0;
    walk_t walk = walk_begin(problem, estimate->shape);
    for (size_t k = 0; k < problem->to; k++) {
        const double bend = c[0] + estimate->bilinear * input_before(problem, k);
        walk_step(&walk, row);
        const double sum = predict(estimate, problem->basis.columns, row);
        const double own = sum + bend * past[0] + c[1] * past[1] + c[2] * past[2];
        past[2] = past[1];
        past[1] = past[0];
        past[0] = own;
        if (k >= problem->from) {
            one_step += gsl_pow_2(sum + bend * y[k - 1] + c[1] * y[k - 2] + c[2] * y[k - 3] - y[k]);
            simulated += gsl_pow_2(own - y[k]);
            power += gsl_pow_2(y[k]);
        }
    }
    const double samples = (double)(problem->to - problem->from);
    estimate->one_step_rms_um = sqrt(one_step / samples);
    /* A thousand times the displacement is no simulation any more. */
    estimate->simulated_rms_um = simulated < 1e6 * power ? sqrt(simulated / samples) : HUGE_VAL;
}

/* The drive's own weight when every other column brings `share` of the drive along. */
static double direct_weight(const double *x, size_t columns, double share) {
    double direct = x[0];
    for (size_t i = 1; i < columns; i++) {
        direct += share * x[i];
    }
    return direct;
}

static void take_linear(const recursion_problem_t *problem, const double *x, double share,
                        recursion_estimate_t *estimate) {
    const size_t columns = problem->basis.columns;
    memcpy(estimate->weight, x, columns * sizeof(double));
    estimate->weight[0] = direct_weight(x, columns, share);
    memcpy(estimate->harmonic, x + columns, sizeof estimate->harmonic);
    estimate->offset_um = x[columns + RECURSION_HARMONICS];
}

bool recursion_fit_one_step(const recursion_problem_t *problem, recursion_estimate_t *estimate, failure_t *failure) {
    const size_t own = problem->basis.columns + AFTER,
                 unknowns = own + RECURSION_FEEDBACK + (problem->bilinear ? 1 : 0);
    const double *y = problem->recording->column[COLUMN_DISPLACEMENT];
    double row[ROW], x[ROW], lower[ROW];
    normal_equations_t equations;
    memset(estimate, 0, sizeof *estimate);
    memcpy(estimate->shape, problem->basis.shape_start, sizeof estimate->shape);
    normal_equations_create(&equations, unknowns);
    walk_t walk = walk_begin(problem, estimate->shape);
    for (size_t k = 0; k < problem->to; k++) {
        walk_step(&walk, row);
        if (k >= problem->from) { /* a period into the recording: there are three samples before it */
            for (size_t i = 0; i < RECURSION_FEEDBACK; i++) {
                row[own + i] = y[k - 1 - i];
            }
            row[own + RECURSION_FEEDBACK] = input_before(problem, k) * y[k - 1];
            normal_equations_add(&equations, row, y[k]);
        }
    }
    normal_equations_finish(&equations);
    for (size_t i = 0; i < unknowns; i++) {
        lower[i] = -HUGE_VAL;
    }
    const bool good = solve_bounded(&equations, lower, x, NULL, failure);
    if (good) {
        take_linear(problem, x, 0.0, estimate);
        memcpy(estimate->feedback, x + own, sizeof estimate->feedback);
        estimate->bilinear = problem->bilinear ? x[own + RECURSION_FEEDBACK] : 0.0;
        judge(problem, estimate);
    }
    normal_equations_free(&equations);
    return good;
}

typedef struct {
    const recursion_problem_t *problem;
    bool bilinear;
    double lower[ROW];
    double shrink; /* roots have to be inside the circle of 1 / shrink */
    double *past;  /* three filtered rows */
    double *rows;  /* of all samples, where no shape changes them and they are not too many; else NULL */
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

/* How much the harmonics answer to a change of the drive before, at most: the slopes of u, u^3 and u^5 at u = 1. */
static double harmonics_slope(const double harmonic[RECURSION_HARMONICS]) {
    return hypot(harmonic[0], harmonic[3]) + 3.0 * hypot(harmonic[1], harmonic[4]) +
           5.0 * hypot(harmonic[2], harmonic[5]);
}

/* Solves, and pulls the harmonics towards 0 until the inverse bears them. */
static bool solve_invertible(const search_t *search, normal_equations_t *equations, double *x, double *rms) {
    const size_t columns = search->problem->basis.columns;
    double *const harmonic = x + columns;
    double pull = 1e-9 * equations->power, pulled = 0.0;
    for (;;) {
        double part = 0.0, unit[ROW] = {0.0};
        if (!solve_bounded(equations, search->lower, x, NULL, search->failure)) {
            return false;
        }
        const double direct = direct_weight(x, columns, least_direct);
        for (size_t i = 0; i < RECURSION_HARMONICS; i++) {
            part += gsl_pow_2((double)(2 * (i % 3) + 1) * harmonic[i]);
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

/* The best linear numbers for x: feedback, shapes, bilinear gain. Returns the RMS error, HUGE_VAL where x is no good.
 */
static double solve_for(const double *x, void *context) {
    search_t *search = context;
    const recursion_problem_t *problem = search->problem;
    recursion_estimate_t *estimate = search->estimate;
    const size_t n = problem->basis.columns + AFTER, shapes = problem->basis.shapes;
    const double *y = problem->recording->column[COLUMN_DISPLACEMENT];
    double row[ROW], solution[ROW], *past = search->past;
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
    walk_t walk = walk_begin(problem, estimate->shape);
    for (size_t k = 0; k < problem->to; k++) {
        const double *c = estimate->feedback, bend = c[0] + estimate->bilinear * input_before(problem, k);
        const double *own = search->rows != NULL ? search->rows + k * n : row;
        double *newest = past + k % RECURSION_FEEDBACK * n; /* overwrites the oldest, in place */
        const double *last = past + (k + 2) % RECURSION_FEEDBACK * n, *before = past + (k + 1) % RECURSION_FEEDBACK * n;
        if (search->rows == NULL) {
            walk_step_shared(&walk, row);
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
        take_linear(problem, solution, least_direct, estimate);
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

static double search_from(search_t *search, recursion_estimate_t start, recursion_estimate_t *best, double least) {
    const size_t shapes = search->problem->basis.shapes;
    double x[NONLINEAR];
    to_search(search, &start, x);
    const simplex_job_t job = {.function = solve_for,
                               .context = search,
                               .dimensions = RECURSION_FEEDBACK + shapes + (search->bilinear ? 1 : 0),
                               .step = 0.2,
                               .size = 1e-3,
                               .most_iterations = MOST_ITERATIONS};
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
                       .most_evaluations = 90.0 + (problem->bilinear ? 4.0 : 2.0) * MOST_ITERATIONS};
    const size_t n = problem->basis.columns + AFTER;
    double least = HUGE_VAL;
    if (!recursion_fit_one_step(problem, &one_step, failure)) {
        return false;
    }
    for (size_t i = 0; i < n; i++) {
        search.lower[i] = i < problem->basis.columns ? problem->basis.lower[i] : -HUGE_VAL;
    }
    search.past = allocate(RECURSION_FEEDBACK * n, sizeof(double));
    if (problem->basis.shapes == 0 && problem->to * n <= MOST_KEPT) {
        walk_t walk = walk_begin(problem, one_step.shape);
        search.rows = allocate(problem->to * n, sizeof(double));
        for (size_t k = 0; k < problem->to; k++) {
            walk_step_shared(&walk, search.rows + k * n);
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
    free(search.rows);
    if (!isfinite(least)) {
        return fail(failure, "%s: no stable recursion comes near the displacement", problem->recording->name);
    }
    judge(problem, estimate);
    return true;
}

void recursion_set(model_block_t *block, const recursion_problem_t *problem, const recursion_estimate_t *estimate) {
    model_set(block, "center_v", problem->drive.offset);
    model_set(block, "half_range_v", problem->drive.amplitude);
    model_set_array(block, "feedback", RECURSION_FEEDBACK, estimate->feedback, NULL);
    model_set(block, "bilinear_gain", estimate->bilinear);
    model_set_array(block, "harmonics_um", RECURSION_HARMONICS, estimate->harmonic, NULL);
    model_set(block, "frequency_hz", problem->drive.frequency_hz);
    model_set(block, "phase_rad", problem->drive.phase);
    model_set(block, "offset_um", estimate->offset_um);
}

/* JSON has no infinity. */
static void set_fact(model_t *model, const char *key, double value) {
    if (isfinite(value)) {
        json_object_set_new(model->fit, key, json_real(value));
    }
}

void recursion_report(model_t *model, family_notes_t *notes, const recursion_estimate_t *one_step,
                      const recursion_estimate_t *estimate) {
    char simulated[40] = "runs away";
    model->fit = json_object();
    set_fact(model, "simulated_rms_um", estimate->simulated_rms_um);
    set_fact(model, "one_step_rms_um", estimate->one_step_rms_um);
    set_fact(model, "least_squares_one_step_rms_um", one_step->one_step_rms_um);
    set_fact(model, "least_squares_simulated_rms_um", one_step->simulated_rms_um);
    if (isfinite(one_step->simulated_rms_um)) {
        snprintf(simulated, sizeof simulated, "leaves %.4g um", one_step->simulated_rms_um);
    }
    family_note(notes, "fitted as a simulation: leaves %.4g um rms, %.4g um when it is given the measured positions",
                estimate->simulated_rms_um, estimate->one_step_rms_um);
    family_note(notes, "fitted to predict one step, as recursive least squares do: %.4g um rms, but simulated it %s",
                one_step->one_step_rms_um, simulated);
}
