/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "look/path/clocks.h"
#include "numerics/autocorrelation.h"
#include <gsl/gsl_cblas.h>
#include <gsl/gsl_math.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { PHASES = 16, WINDOWS_PER_TOOTH = 8, MOST_TEETH = 48, STEPS_PER_TOOTH = 4, FINER = 4, REFINEMENTS = 24 };
static const double least_teeth = 1.5;

typedef struct {
    size_t windows, columns;
    double *product, *square; /* A and B of each window */
    double *white;            /* W C of each, columns of them */
    double *course, *sum;     /* room: PHASES courses, and what they sum up to */
} moments_t;

static double saw_at(double teeth, double phase, double part) {
    const double x = teeth * part + phase;
    return x - round(x);
}

static double *slope_of_fit(const problem_t *p, const double *residual) {
    double *slope = allocate(p->n, sizeof *slope);
    for (size_t k = 1; k + 1 < p->n; k++) {
        slope[k] = 0.5 * (p->y[k + 1] - residual[k + 1] - p->y[k - 1] + residual[k - 1]);
    }
    return slope;
}

static void make_moments(const problem_t *p, const double *residual, const double *slope, moments_t *m) {
    const size_t width = p->columns + 2;
    const double *const signal[] = {slope}, *const other[] = {residual, slope};
    double *sums = allocate(p->windows * width, sizeof *sums);
    *m = (moments_t){.windows = p->windows, .columns = p->columns};
    m->product = allocate(p->windows, sizeof *m->product);
    m->square = allocate(p->windows, sizeof *m->square);
    m->white = allocate(p->windows * p->columns, sizeof *m->white);
    m->course = allocate(PHASES * p->windows, sizeof *m->course);
    m->sum = allocate(PHASES * p->columns, sizeof *m->sum);
    problem_window_products(p, signal, 1, other, 2, sums);
    for (size_t w = 0; w < p->windows; w++) {
        const double *of_columns = sums + w * width, *of_other = of_columns + p->columns;
        double *white = m->white + w * p->columns;
        m->product[w] = of_other[0];
        m->square[w] = of_other[1];
        memcpy(white, of_columns, p->columns * sizeof *white);
    }
    column_factor_whiten(&p->factor, m->white, m->windows, m->columns);
    free(sums);
}

static void free_moments(moments_t *m) {
    free(m->product);
    free(m->square);
    free(m->white);
    free(m->course);
    free(m->sum);
}

/* W sum L C of the first courses. */
static void sum_courses(moments_t *m, size_t courses) {
    cblas_dgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, (int)courses, (int)m->columns, (int)m->windows, 1.0,
                m->course, (int)m->windows, m->white, (int)m->columns, 0.0, m->sum, (int)m->columns);
}

/* Sizes of so many phases of a saw tooth, 1 / PHASES apart; returns the one that takes most away. */
static double best_phase(moments_t *m, double teeth, double phase, size_t phases, double *best, double *size) {
    double most = 0.0;
    for (size_t i = 0; i < phases; i++) {
        for (size_t w = 0; w < m->windows; w++) {
            m->course[i * m->windows + w] =
                saw_at(teeth, phase + (double)i / PHASES, ((double)w + 0.5) / (double)m->windows);
        }
    }
    sum_courses(m, phases);
    for (size_t i = 0; i < phases; i++) {
        const double *course = m->course + i * m->windows, *sum = m->sum + i * m->columns;
        double moment = 0.0, square = 0.0;
        for (size_t w = 0; w < m->windows; w++) {
            moment -= course[w] * m->product[w];
            square += course[w] * course[w] * m->square[w];
        }
        const double alone = square - problem_dot(sum, sum, m->columns);
        if (alone > 1e-9 * square && moment * moment / alone > most) {
            most = moment * moment / alone;
            *best = phase + (double)i / PHASES;
            *size = moment / alone;
        }
    }
    return most;
}

/* The same of a sine and a cosine, each of free size. */
static double best_wave(moments_t *m, double waves) {
    double moment[2] = {0.0, 0.0}, square[3] = {0.0, 0.0, 0.0}; /* of sine, both, cosine */
    for (size_t w = 0; w < m->windows; w++) {
        const double turn = 2.0 * M_PI * waves * ((double)w + 0.5) / (double)m->windows, s = sin(turn), c = cos(turn);
        m->course[w] = s;
        m->course[m->windows + w] = c;
        moment[0] -= s * m->product[w];
        moment[1] -= c * m->product[w];
        square[0] += s * s * m->square[w];
        square[1] += s * c * m->square[w];
        square[2] += c * c * m->square[w];
    }
    sum_courses(m, 2);
    const double *sine = m->sum, *cosine = m->sum + m->columns;
    square[0] -= problem_dot(sine, sine, m->columns);
    square[1] -= problem_dot(sine, cosine, m->columns);
    square[2] -= problem_dot(cosine, cosine, m->columns);
    const double determinant = square[0] * square[2] - square[1] * square[1];
    return determinant > 1e-9 * square[0] * square[2]
               ? (square[2] * moment[0] * moment[0] - 2.0 * square[1] * moment[0] * moment[1] +
                  square[0] * moment[1] * moment[1]) /
                     determinant
               : 0.0;
}

/* The likeliest of half to twice a rate. */
static double best_wave_near(moments_t *m, double teeth) {
    double most = 0.0;
    const size_t steps = (size_t)(1.5 * teeth * STEPS_PER_TOOTH);
    for (size_t step = 0; step <= steps; step++) {
        most = fmax(most, best_wave(m, 0.5 * teeth + (double)step / STEPS_PER_TOOTH));
    }
    return most;
}

/* A saw tooth, and what it takes away. */
typedef struct {
    double teeth, phase, size, taken;
} saw_t;

/* All phases at a rate, from one on; the best so far is kept. */
static void try_rate(moments_t *m, double teeth, double phase, saw_t *best) {
    saw_t tried = {.teeth = teeth};
    tried.taken = best_phase(m, teeth, phase, PHASES, &tried.phase, &tried.size);
    if (tried.taken > best->taken) {
        *best = tried;
    }
}

/* Rates and phases between those that were tried. What is taken away has several tops there: a jump that is a little
 * off costs little, and then nearly all of it. */
static void look_closer(moments_t *m, saw_t *best) {
    const double middle = best->teeth, step = 1.0 / (STEPS_PER_TOOTH * 2 * FINER);
    for (int i = -2 * FINER; i <= 2 * FINER; i++) {
        for (int j = 0; j < FINER; j++) {
            try_rate(m, middle + i * step, (double)j / (PHASES * FINER), best);
        }
    }
}

/* Rate and phase in turn, the rate about the middle. */
static void refine(moments_t *m, saw_t *saw) {
    double step_teeth = 0.5 / (STEPS_PER_TOOTH * 2 * FINER), step_phase = 0.5 / (PHASES * FINER);
    for (size_t i = 0; i < REFINEMENTS; i++) {
        for (int direction = 0; direction < 4; direction++) {
            const double more = direction == 0 ? step_teeth : direction == 1 ? -step_teeth : 0.0;
            const double later = direction == 2 ? step_phase : direction == 3 ? -step_phase : -0.5 * more;
            saw_t tried = {.teeth = saw->teeth + more};
            tried.taken = best_phase(m, tried.teeth, saw->phase + later, 1, &tried.phase, &tried.size);
            if (tried.taken > saw->taken) {
                *saw = tried;
            }
        }
        if (i % 3 == 2) {
            step_teeth *= 0.5;
            step_phase *= 0.5;
        }
    }
}

void clocks_find(problem_t *p, double rate_hz, double without, double *residual, lag_course_t *saw) {
    double *slope = slope_of_fit(p, residual), *as_read = problem_copy(p);
    const double most_teeth = fmin(MOST_TEETH, (double)p->windows / WINDOWS_PER_TOOTH);
    saw_t best = {0};
    moments_t m;
    memset(saw, 0, sizeof *saw);
    make_moments(p, residual, slope, &m);
    for (size_t step = 0; least_teeth + (double)step / STEPS_PER_TOOTH < most_teeth; step++) {
        try_rate(&m, least_teeth + (double)step / STEPS_PER_TOOTH, 0.0, &best);
    }
    if (best.taken > 0.0) {
        look_closer(&m, &best);
        refine(&m, &best);
        for (size_t k = 0; k < p->n; k++) {
            p->y[k] += best.size * saw_at(best.teeth, best.phase, ((double)k + 0.5) / (double)p->n) * slope[k];
        }
        const residual_run_t run = {residual, p->n};
        saw->left = problem_residual(p, residual);
        saw->teeth_per_s = best.teeth * rate_hz / (double)p->n;
        saw->phase = best.phase + (0.5 - (double)p->first) * best.teeth / (double)p->n;
        saw->size = best.size;
        saw->sigma = fabs(best.size) * sqrt(saw->left / (double)p->n * autocorrelation_time(&run, 1) / best.taken);
        saw->by_wave = best_wave_near(&m, best.teeth) / best.taken;
        saw->log_chance = problem_chance(p, without, saw->left, residual, 3.0, STEPS_PER_TOOTH * most_teeth);
        problem_restore(p, as_read);
    }
    free_moments(&m);
    free(slope);
    free(as_read);
}
