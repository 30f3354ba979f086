/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "look/steps.h"
#include "numerics/autocorrelation.h"
#include "numerics/simplex.h"
#include "thresholds/thresholds.h"
#include <gsl/gsl_math.h>
#include <stdlib.h>
#include <string.h>

enum { BASELINE = 5, RING = 2, SHAPE = 2, LEAST_WINDOW = 24, MOST_WINDOW = 2048, MOST_ROUNDS = 3 };

typedef struct {
    const double *y;
    size_t count;
    double rate_hz;
    double *columns; /* BASELINE + RING + SHAPE of them */
    look_regression_t fit;
} window_t;

static void fill_ring(window_t *w, double f, double alpha) {
    double *c = w->columns + BASELINE * w->count, *s = c + w->count;
    for (size_t k = 0; k < w->count; k++) {
        const double t = (double)k / w->rate_hz, decay = exp(-alpha * t);
        c[k] = decay * cos(2.0 * M_PI * f * t);
        s[k] = decay * sin(2.0 * M_PI * f * t);
    }
}

static double left_with(window_t *w, size_t columns) {
    const double *column[BASELINE + RING + SHAPE];
    for (size_t i = 0; i < BASELINE + RING + SHAPE; i++) {
        column[i] = w->columns + i * w->count;
    }
    return look_regress(column, columns, w->y, NULL, w->count, &w->fit) ? w->fit.rms : HUGE_VAL;
}

/* x: log of frequency and of alpha. */
static double misfit(const double *x, void *context) {
    window_t *w = context;
    const double f = exp(x[0]), alpha = exp(x[1]);
    if (f > 0.5 * w->rate_hz || alpha > 4.0 * f || alpha * (double)w->count / w->rate_hz < 0.1) {
        return HUGE_VAL;
    }
    fill_ring(w, f, alpha);
    return log(left_with(w, BASELINE + RING) + 1e-300);
}

static double *residual_of(const window_t *w, size_t columns) {
    double *rest = allocate(w->count, sizeof *rest);
    for (size_t k = 0; k < w->count; k++) {
        rest[k] = w->y[k];
        for (size_t i = 0; i < columns; i++) {
            rest[k] -= w->fit.coefficient[i] * w->columns[i * w->count + k];
        }
    }
    return rest;
}

/* Frequency of the largest line beside the baseline: the first sixteenth counts, where a ring is strong, then more. */
static double largest_line(const window_t *w, size_t used) {
    const size_t length = look_smooth_length(4 * used);
    double *rest = residual_of(w, BASELINE), *padded = allocate(length, sizeof *padded);
    double *spectrum = allocate(length + 2, sizeof *spectrum), best = 0.0;
    size_t at = 0;
    memcpy(padded, rest, used * sizeof *padded);
    look_transform(padded, length, spectrum);
    for (size_t h = 4; (double)h < threshold.highest_ring * (double)length / 2.0; h++) {
        const double power = spectrum[2 * h] * spectrum[2 * h] + spectrum[2 * h + 1] * spectrum[2 * h + 1];
        at = power > best ? h : at;
        best = fmax(best, power);
    }
    free(rest);
    free(padded);
    free(spectrum);
    return (double)at * w->rate_hz / (double)length;
}

static void fill_shape(window_t *w, double f, double alpha) {
    const double a = w->fit.coefficient[BASELINE], b = w->fit.coefficient[BASELINE + 1];
    double *by_f = w->columns + (BASELINE + RING) * w->count, *by_alpha = by_f + w->count;
    for (size_t k = 0; k < w->count; k++) {
        const double t = (double)k / w->rate_hz, decay = exp(-alpha * t), x = 2.0 * M_PI * f * t;
        by_f[k] = decay * 2.0 * M_PI * t * (b * cos(x) - a * sin(x));
        by_alpha[k] = -t * decay * (a * cos(x) + b * sin(x));
    }
}

/* One ring, from one step. false: nothing rings. */
static bool ring_of(window_t *w, ring_t *ring) {
    const double without = left_with(w, BASELINE);
    double x[SHAPE] = {0}, least = HUGE_VAL;
    for (size_t part = 1; part <= 16; part *= 4) {
        const size_t used = w->count / part;
        double start[SHAPE];
        left_with(w, BASELINE);
        start[0] = log(fmax(largest_line(w, used > 16 ? used : w->count), w->rate_hz / (double)w->count));
        start[1] = log(3.0 * w->rate_hz / (double)used);
        const simplex_job_t job = {misfit, w, SHAPE, 0.05, 1e-7, 400};
        const double here = simplex_minimise(&job, start);
        if (here < least) {
            least = here;
            memcpy(x, start, sizeof x);
        }
    }
    const double f = exp(x[0]), alpha = exp(x[1]), duration = (double)w->count / w->rate_hz;
    if (!isfinite(least) || f > threshold.highest_ring * 0.5 * w->rate_hz || f < threshold.ring_cycles * alpha ||
        f * duration < threshold.ring_cycles_in_window) {
        return false;
    }
    misfit(x, w);
    const double swing = hypot(w->fit.coefficient[BASELINE], w->fit.coefficient[BASELINE + 1]);
    fill_shape(w, f, alpha);
    left_with(w, BASELINE + RING + SHAPE);
    double *rest = residual_of(w, BASELINE + RING + SHAPE);
    const residual_run_t run = {rest, w->count};
    const double tau = autocorrelation_time(&run, 1), n = (double)w->count / tau;
    /* Likelihood ratio with four numbers more, for about w->count independent frequencies: chi-square's tail. */
    const double log_chance = -n * log10(without / w->fit.rms) + log10((double)w->count);
    free(rest);
    if (!(log_chance < log10(threshold.false_ring))) {
        return false;
    }
    const double omega = hypot(2.0 * M_PI * f, alpha), widen = sqrt(tau);
    const double alpha_sigma = w->fit.sigma[BASELINE + RING + 1] * widen;
    ring->rings = 1;
    ring->swing_um = swing;
    ring->frequency_hz = f;
    ring->frequency_sigma_hz = w->fit.sigma[BASELINE + RING] * widen;
    ring->damping = alpha / omega;
    ring->damping_sigma = alpha_sigma / omega;
    return isfinite(ring->frequency_sigma_hz) && isfinite(ring->damping_sigma);
}

/* Baseline from the first sample behind the step on. */
static void open_window(const recording_t *recording, const drive_look_t *drive, size_t which, window_t *w) {
    const double *u = recording->column[COLUMN_DRIVE];
    const size_t at = drive->step[which];
    size_t to = which + 1 < drive->steps ? drive->step[which + 1] : recording->samples;
    to = to - at > MOST_WINDOW ? at + MOST_WINDOW : to;
    w->y = recording->column[COLUMN_DISPLACEMENT] + at;
    w->count = to - at;
    w->rate_hz = recording->sample_rate_hz;
    w->columns = allocate((BASELINE + RING + SHAPE) * w->count, sizeof *w->columns);
    for (size_t k = 0; k < w->count; k++) {
        const double x = (double)k / (double)w->count;
        w->columns[k] = 1.0;
        w->columns[w->count + k] = x;
        w->columns[2 * w->count + k] = x * x;
        w->columns[3 * w->count + k] = log1p((double)k);
        w->columns[4 * w->count + k] = u[at + k] - u[at];
    }
}

static double step_height(const double *u, size_t at) {
    return u[at] - u[at - 1];
}

void ring_look(const recording_t *recording, const drive_look_t *drive, ring_t *ring) {
    const double *u = recording->column[COLUMN_DRIVE];
    const size_t steps = drive->steps < RING_MOST_STEPS ? drive->steps : RING_MOST_STEPS;
    ring_t *one = allocate(steps, sizeof *one);
    size_t strongest = steps;
    memset(ring, 0, sizeof *ring);
    for (size_t i = 0; i < steps; i++) {
        window_t w;
        open_window(recording, drive, i, &w);
        if (w.count >= LEAST_WINDOW && ring_of(&w, &one[i])) {
            one[i].at = drive->step[i];
            one[i].step_v = step_height(u, drive->step[i]);
            strongest = strongest == steps || one[i].swing_um > one[strongest].swing_um ? i : strongest;
        }
        free(w.columns);
    }
    if (strongest < steps) {
        double wf = 0.0, wd = 0.0, f = 0.0, d = 0.0, scatter_f = 0.0, scatter_d = 0.0;
        *ring = one[strongest];
        ring->rings = 0;
        for (size_t i = 0; i < steps; i++) {
            if (one[i].rings > 0 &&
                fabs(log(one[i].frequency_hz / one[strongest].frequency_hz)) < threshold.same_ring) {
                const double a = 1.0 / pow(one[i].frequency_sigma_hz, 2.0), b = 1.0 / pow(one[i].damping_sigma, 2.0);
                wf += a;
                wd += b;
                f += a * one[i].frequency_hz;
                d += b * one[i].damping;
                ring->step[ring->rings++] = one[i].at;
            }
        }
        ring->frequency_hz = f / wf;
        ring->damping = d / wd;
        for (size_t i = 0; i < steps; i++) {
            if (one[i].rings > 0 &&
                fabs(log(one[i].frequency_hz / one[strongest].frequency_hz)) < threshold.same_ring) {
                scatter_f += pow((one[i].frequency_hz - ring->frequency_hz) / one[i].frequency_sigma_hz, 2.0);
                scatter_d += pow((one[i].damping - ring->damping) / one[i].damping_sigma, 2.0);
            }
        }
        /* Birge's ratio: where single steps scatter more than their errors say, theirs are too small. */
        const double freedom = ring->rings > 1 ? (double)(ring->rings - 1) : 1.0;
        ring->frequency_sigma_hz = sqrt(1.0 / wf * fmax(1.0, scatter_f / freedom));
        ring->damping_sigma = sqrt(1.0 / wd * fmax(1.0, scatter_d / freedom));
    }
    free(one);
}
