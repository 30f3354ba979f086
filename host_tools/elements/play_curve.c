/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "elements/play_curve.h"
#include "base/failure.h"
#include <math.h>
#include <stdlib.h>

/* Corners of F: (0, 0), one a threshold, (range, F(range)). kept[] holds the indices of the corners still used. */
typedef struct {
    size_t corners, kept_count;
    double *r, *f;
    size_t *kept;
} curve_t;

static curve_t curve_create(const play_bank_t *bank, double range) {
    curve_t curve = {.r = allocate(bank->operators + 2, sizeof(double)),
                     .f = allocate(bank->operators + 2, sizeof(double)),
                     .kept = allocate(bank->operators + 2, sizeof(size_t))};
    double slope = bank->weight[0];
    for (size_t i = 0; i <= bank->operators; i++) {
        const bool inside = i < bank->operators && bank->threshold[i] < range;
        const double r = inside ? bank->threshold[i] : range;
        curve.corners++;
        curve.r[i + 1] = r;
        curve.f[i + 1] = curve.f[i] + slope * (r - curve.r[i]);
        if (!inside) {
            break;
        }
        slope += bank->weight[i + 1];
    }
    curve.corners++; /* the origin */
    curve.kept_count = curve.corners;
    for (size_t i = 0; i < curve.corners; i++) {
        curve.kept[i] = i;
    }
    return curve;
}

/* Largest distance of F from its chord between two corners. */
static double chord_error(const curve_t *curve, size_t from, size_t to) {
    const double slope = (curve->f[to] - curve->f[from]) / (curve->r[to] - curve->r[from]);
    double worst = 0.0;
    for (size_t i = from + 1; i < to; i++) {
        worst = fmax(worst, fabs(curve->f[from] + slope * (curve->r[i] - curve->r[from]) - curve->f[i]));
    }
    return worst;
}

static void remove_corner(curve_t *curve, size_t position) {
    curve->kept_count--;
    for (size_t i = position; i < curve->kept_count; i++) {
        curve->kept[i] = curve->kept[i + 1];
    }
}

static void remove_corners(curve_t *curve, size_t most, double tolerance, double spacing) {
    for (;;) {
        size_t cheapest = 0;
        double cheapest_error = HUGE_VAL;
        for (size_t i = 1; i + 1 < curve->kept_count; i++) {
            const size_t before = curve->kept[i - 1], after = curve->kept[i + 1];
            const bool close = curve->r[curve->kept[i]] - curve->r[before] < spacing;
            const double error = close ? 0.0 : chord_error(curve, before, after);
            if (error < cheapest_error) {
                cheapest_error = error;
                cheapest = i;
            }
        }
        if (cheapest == 0 || (curve->kept_count - 2 <= most && cheapest_error > tolerance)) {
            return;
        }
        remove_corner(curve, cheapest);
    }
}

double play_bank_thin(play_bank_t *bank, size_t most, double range, double tolerance, double spacing) {
    curve_t curve = curve_create(bank, range);
    double worst = 0.0, slope_before = 0.0;
    remove_corners(&curve, most, tolerance, spacing);
    bank->operators = curve.kept_count - 2;
    for (size_t i = 0; i + 1 < curve.kept_count; i++) {
        const size_t from = curve.kept[i], to = curve.kept[i + 1];
        const double slope = (curve.f[to] - curve.f[from]) / (curve.r[to] - curve.r[from]);
        worst = fmax(worst, chord_error(&curve, from, to));
        bank->weight[i] = slope - slope_before;
        if (i > 0) {
            bank->threshold[i - 1] = curve.r[from];
        }
        slope_before = slope;
    }
    free(curve.r);
    free(curve.f);
    free(curve.kept);
    return 2.0 * worst;
}
