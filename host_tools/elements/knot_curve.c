/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "elements/knot_curve.h"
#include <gsl/gsl_linalg.h>
#include <math.h>
#include <string.h>

void knot_curve_make(const double value[KNOT_CURVE_KNOTS], knot_curve_t *curve) {
    enum { INNER = KNOT_CURVE_INTERVALS - 1 };
    double diagonal[INNER], beside[INNER - 1], turn[INNER];
    memcpy(curve->value, value, sizeof curve->value);
    for (size_t i = 0; i < INNER; i++) {
        diagonal[i] = 4.0;
        turn[i] = 6.0 * (value[i] - 2.0 * value[i + 1] + value[i + 2]);
        if (i > 0) {
            beside[i - 1] = 1.0;
        }
    }
    const gsl_vector_view d = gsl_vector_view_array(diagonal, INNER), e = gsl_vector_view_array(beside, INNER - 1),
                          t = gsl_vector_view_array(turn, INNER);
    gsl_vector_view bend = gsl_vector_view_array(curve->bend + 1, INNER);
    gsl_linalg_solve_symm_tridiag(&d.vector, &e.vector, &t.vector, &bend.vector); /* diagonally dominant */
    curve->bend[0] = curve->bend[KNOT_CURVE_INTERVALS] = 0.0;
}

static double slope_at(const knot_curve_t *curve, size_t i, double t) {
    const double s = 1.0 - t;
    return curve->value[i + 1] - curve->value[i] - (3.0 * s * s - 1.0) * curve->bend[i] / 6.0 +
           (3.0 * t * t - 1.0) * curve->bend[i + 1] / 6.0;
}

double knot_curve_at(const knot_curve_t *curve, double x) {
    const double inside = fmax(0.0, fmin(x, KNOT_CURVE_INTERVALS));
    const size_t i = inside < KNOT_CURVE_INTERVALS ? (size_t)inside : KNOT_CURVE_INTERVALS - 1;
    const double t = inside - (double)i, s = 1.0 - t;
    return s * curve->value[i] + t * curve->value[i + 1] + s * (s * s - 1.0) * curve->bend[i] / 6.0 +
           t * (t * t - 1.0) * curve->bend[i + 1] / 6.0 + (x == inside ? 0.0 : (x - inside) * slope_at(curve, i, t));
}

double knot_curve_least_slope(const knot_curve_t *curve) {
    double least = HUGE_VAL;
    for (size_t i = 0; i < KNOT_CURVE_INTERVALS; i++) {
        const double from = curve->bend[i], to = curve->bend[i + 1];
        least = fmin(least, fmin(slope_at(curve, i, 0.0), slope_at(curve, i, 1.0)));
        if (from < 0.0 && to > 0.0) {
            least = fmin(least, slope_at(curve, i, from / (from - to)));
        }
    }
    return least;
}
