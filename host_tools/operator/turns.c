/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "operator/turns.h"
#include "thresholds/thresholds.h"
#include <math.h>
#include <stdbool.h>

enum { STENCIL = 5, NEWTON_STEPS = 8 };

/* Forward differences of five values: difference[i] is of order i. */
static void differences(const double *x, double difference[STENCIL]) {
    double d[STENCIL];
    for (int i = 0; i < STENCIL; i++) {
        d[i] = x[i];
    }
    for (int order = 0; order < STENCIL; order++) {
        difference[order] = d[0];
        for (int i = 0; i + 1 < STENCIL - order; i++) {
            d[i] = d[i + 1] - d[i];
        }
    }
}

/* Newton's form of the quartic through the stencil as powers of t, its first sample at 0. */
static void powers(const double d[STENCIL], double c[STENCIL]) {
    c[0] = d[0];
    c[1] = d[1] - d[2] / 2.0 + d[3] / 3.0 - d[4] / 4.0;
    c[2] = d[2] / 2.0 - d[3] / 2.0 + 11.0 * d[4] / 24.0;
    c[3] = d[3] / 6.0 - d[4] / 4.0;
    c[4] = d[4] / 24.0;
}

/* The extreme of the quartic next to t = at, if it is within a sample of it. */
static bool extreme_beside(const double c[STENCIL], double at, double *t) {
    *t = at;
    for (int i = 0; i < NEWTON_STEPS; i++) {
        const double slope = c[1] + *t * (2.0 * c[2] + *t * (3.0 * c[3] + *t * 4.0 * c[4])),
                     bend = 2.0 * c[2] + *t * (6.0 * c[3] + *t * 12.0 * c[4]);
        if (bend == 0.0 || fabs(*t - at) > 2.0) {
            return false;
        }
        *t -= slope / bend;
    }
    return fabs(*t - at) < 1.0;
}

/* Where two straight sides meet: the left one through value[at - 1] and value[at], the right one through value[at + 1]
 * and value[at + 2]. */
static void corner_between(const double *value, size_t samples, size_t at, double *way) {
    if (at < 2 || at + 3 >= samples) {
        return;
    }
    const double *x = value + at, left = x[0] - x[-1], right = x[2] - x[1];
    const double bend = fmax(fabs(x[0] - 2.0 * x[-1] + x[-2]), fabs(x[3] - 2.0 * x[2] + x[1]));
    const double t = (x[1] - right - x[0]) / (left - right);
    if (left * right < 0.0 && bend < threshold.most_bent * fabs(left - right) && t > 0.0 && t < 1.0) {
        way[at + 1] = x[0] + t * left;
    }
}

static void turn_at(const double *value, size_t samples, size_t k, double *way) {
    double least = HUGE_VAL, c[STENCIL] = {0}, d[STENCIL], t;
    size_t best = samples;
    for (size_t back = 0; back < STENCIL; back++) {
        if (k < back || k - back + STENCIL > samples) {
            continue;
        }
        differences(value + k - back, d);
        const double wiggle = fabs(d[4]) * (1.0 + threshold.off_centre * fabs((double)back - 2.0));
        if (wiggle < least) {
            least = wiggle;
            best = k - back;
        }
    }
    if (best == samples) {
        return;
    }
    const double before = value[k] - value[k - 1], after = value[k + 1] - value[k], bend = after - before;
    differences(value + best, d);
    powers(d, c);
    if (least <= threshold.most_wiggle * fabs(bend) && extreme_beside(c, (double)(k - best), &t)) {
        const double extreme = c[0] + t * (c[1] + t * (c[2] + t * (c[3] + t * c[4]))), beyond = extreme - value[k];
        /* A maximum has bend < 0 and is reached from below. */
        if (beyond * bend < 0.0 && fabs(beyond) <= fmax(fabs(before), fabs(after))) {
            way[t < (double)(k - best) ? k : k + 1] = extreme;
        }
    } else {
        corner_between(value, samples, k, way);
        corner_between(value, samples, k - 1, way);
    }
}

void turns_find(const double *value, size_t samples, double *way) {
    for (size_t k = 0; k < samples; k++) {
        way[k] = (double)NAN;
    }
    for (size_t k = 1; k + 1 < samples; k++) {
        const double before = value[k] - value[k - 1], after = value[k + 1] - value[k];
        if (before * after <= 0.0 && before != after) {
            turn_at(value, samples, k, way);
        }
    }
}
