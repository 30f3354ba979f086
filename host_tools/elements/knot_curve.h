/* SPDX-License-Identifier: GPL-3.0-or-later */
/** A smooth curve through values at evenly spaced knots: the natural cubic spline. */
#ifndef KNOT_CURVE_H
#define KNOT_CURVE_H

#include <stddef.h>

enum { KNOT_CURVE_INTERVALS = 8, KNOT_CURVE_KNOTS = KNOT_CURVE_INTERVALS + 1 };

typedef struct {
    double value[KNOT_CURVE_KNOTS];
    double bend[KNOT_CURVE_KNOTS]; /**< second derivatives at the knots */
} knot_curve_t;

/** The curve through these values. */
void knot_curve_make(const double value[KNOT_CURVE_KNOTS], knot_curve_t *curve);
/** Its value at x, in intervals since the first knot. Beyond the ends it is a straight line. */
double knot_curve_at(const knot_curve_t *curve, double x);
/** The least slope that it has anywhere, per interval. */
double knot_curve_least_slope(const knot_curve_t *curve);

#endif
