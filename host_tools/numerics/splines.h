/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Quadratic B-splines over evenly spaced knots. */
#ifndef SPLINES_H
#define SPLINES_H

#include <stddef.h>

/** Spline i (of intervals + 2) at x in [0, intervals]. They sum to 1; spline i is nonzero from i - 2 to i + 1. */
double spline(size_t i, double x);

#endif
