/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "look/path/reference_columns.h"
#include "numerics/between.h"
#include <math.h>
#include <stdlib.h>

enum { FINER = 4, MOST_VALUES = 1 << 25 };
/* Lengths in half ranges of the drive. */
static const double shortest_leak = 0.03, longest_leak = 4.0, past_length[REFERENCE_LENGTHS] = {0.1, 0.3, 1.0, 3.0};
static const double play_power = 1.5, log_of_time = 100.0;

size_t reference_columns_of(size_t samples) {
    return samples * REFERENCE_COLUMNS <= MOST_VALUES ? REFERENCE_COLUMNS : REFERENCE_BY_LEAK;
}

/* The drive as it moves, in `finer` steps a sample; value of sample k at k * finer. */
static double *make_path(const double *x, size_t samples, size_t finer) {
    double *path = allocate(samples * finer, sizeof *path);
    for (size_t k = 0; k < samples; k++) {
        path[k * finer] = x[k];
        for (size_t i = 1; i < finer && k + 1 < samples; i++) {
            path[k * finer + i] = value_between(x, samples, (double)k + (double)i / (double)finer);
        }
    }
    return path;
}

typedef struct {
    const double *path, *x;
    size_t samples, finer;
} walked_t;

/* One play of threshold r over the drive. */
static void run_play(const walked_t *w, double r, double *column) {
    double z = w->path[0];
    column[0] = z;
    for (size_t k = 1; k < w->samples; k++) {
        for (size_t i = (k - 1) * w->finer + 1; i <= k * w->finer; i++) {
            z = fmax(w->path[i] - r, fmin(w->path[i] + r, z));
        }
        column[k] = z;
    }
}

/* z' = x' - |x'| z / length, exact for each step. */
static void run_leak(const walked_t *w, double length, double *column) {
    double z = 0.0;
    column[0] = z;
    for (size_t k = 1; k < w->samples; k++) {
        for (size_t i = (k - 1) * w->finer + 1; i <= k * w->finer; i++) {
            const double way = w->path[i] - w->path[i - 1], end = copysign(1.0, way);
            z = end + (z - end) * exp(-fabs(way) / length);
        }
        column[k] = z;
    }
}

/* Hats over nodes from -1 to 1 at one place. */
static double hat(double at, size_t node, size_t nodes) {
    return fmax(0.0, 1.0 - fabs(0.5 * (at + 1.0) * (double)(nodes - 1) - (double)node));
}

static void fill_past(const walked_t *w, double *columns) {
    const size_t n = w->samples;
    double highest = w->path[0], lowest = w->path[0], way = 0.0;
    for (size_t k = 0; k < n; k++) {
        for (size_t i = k > 0 ? (k - 1) * w->finer + 1 : 0; i <= k * w->finer; i++) {
            way += i > 0 ? fabs(w->path[i] - w->path[i - 1]) : 0.0;
            highest = fmax(highest, w->path[i]);
            lowest = fmin(lowest, w->path[i]);
        }
        for (size_t i = 0; i < REFERENCE_LENGTHS; i++) {
            columns[i * n + k] = exp(-way / past_length[i]);
        }
        for (size_t i = 0; i < REFERENCE_EXTREMES; i++) {
            columns[(REFERENCE_LENGTHS + i) * n + k] = hat(highest, i, REFERENCE_EXTREMES);
            columns[(REFERENCE_LENGTHS + REFERENCE_EXTREMES + i) * n + k] = hat(lowest, i, REFERENCE_EXTREMES);
        }
    }
}

/* Chebyshev polynomials of degree 1 and more at one place, stride apart. */
static void chebyshev(double x, size_t degrees, size_t stride, double *value) {
    double before = 1.0, here = x;
    for (size_t m = 0; m < degrees; m++) {
        const double next = 2.0 * x * here - before;
        value[m * stride] = here;
        before = here;
        here = next;
    }
}

static void fill_bends(size_t samples, const double *plays, double *columns) {
    for (size_t i = 0; i < REFERENCE_PLAYS; i++) {
        const double at = 2.0 * (double)i / (REFERENCE_PLAYS - 1) - 1.0;
        for (size_t k = 0; k < samples; k++) {
            double value[REFERENCE_DEGREES + 1];
            chebyshev(fmax(-1.0, fmin(1.0, plays[i * samples + k])), REFERENCE_DEGREES + 1, 1, value);
            for (size_t node = 0; node < REFERENCE_NODES; node++) {
                const double share = hat(at, node, REFERENCE_NODES);
                for (size_t m = 0; share > 0.0 && m < REFERENCE_DEGREES; m++) {
                    columns[(m * REFERENCE_NODES + node) * samples + k] += share * value[m + 1];
                }
            }
        }
    }
}

static void fill_products(const walked_t *w, const double *leaks, double *columns) {
    const size_t n = w->samples, every = REFERENCE_LEAKS / REFERENCE_MULTIPLIED;
    for (size_t i = 0; i < REFERENCE_MULTIPLIED; i++) {
        double *product = columns + i * REFERENCE_PRODUCTS * n;
        for (size_t k = 0; k < n; k++) {
            const double z = leaks[i * every * n + k];
            product[k] = z * w->x[k];
            product[n + k] = z * z;
            product[2 * n + k] = z * z * z;
            product[3 * n + k] = z * z * w->x[k];
        }
    }
}

void reference_columns_fill(const double *u, size_t samples, const drive_look_t *drive, long shift, double *columns) {
    const double middle = 0.5 * (drive->range_v[0] + drive->range_v[1]);
    const double half = 0.5 * (drive->range_v[1] - drive->range_v[0]);
    const size_t finer = drive->between == BETWEEN_HELD || drive->held_samples > 1 ? 1 : FINER;
    double *x = allocate(samples, sizeof *x);
    for (size_t k = 0; k < samples; k++) {
        const long from = (long)k - shift, last = (long)samples - 1;
        const double time = (double)k / (double)samples;
        x[k] = (u[from < 0 ? 0 : from > last ? last : from] - middle) / half;
        columns[k] = 1.0;
        columns[REFERENCE_BY_TREND * samples + k] = time;
        columns[(REFERENCE_BY_TREND + 1) * samples + k] = log1p(log_of_time * time);
        chebyshev(x[k], REFERENCE_POWERS, samples, columns + REFERENCE_BY_POWER * samples + k);
    }
    for (size_t k = 1; k + 1 < samples; k++) {
        columns[REFERENCE_BY_CURVATURE * samples + k] = x[k - 1] - 2.0 * x[k] + x[k + 1];
    }
    double *path = make_path(x, samples, finer);
    const walked_t walked = {path, x, samples, finer};
    for (size_t i = 0; i < REFERENCE_PLAYS; i++) {
        run_play(&walked, pow((double)(i + 1) / (REFERENCE_PLAYS + 1), play_power),
                 columns + (REFERENCE_BY_PLAY + i) * samples);
    }
    fill_past(&walked, columns + REFERENCE_BY_PAST * samples);
    if (reference_columns_of(samples) == REFERENCE_COLUMNS) {
        for (size_t i = 0; i < REFERENCE_LEAKS; i++) {
            run_leak(&walked, shortest_leak * pow(longest_leak / shortest_leak, (double)i / (REFERENCE_LEAKS - 1)),
                     columns + (REFERENCE_BY_LEAK + i) * samples);
        }
        fill_bends(samples, columns + REFERENCE_BY_PLAY * samples, columns + REFERENCE_BY_BEND * samples);
        fill_products(&walked, columns + REFERENCE_BY_LEAK * samples, columns + REFERENCE_BY_PRODUCT * samples);
    }
    free(x);
    free(path);
}
