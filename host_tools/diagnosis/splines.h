/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Quadratic B-splines over evenly spaced knots. */
#ifndef SPLINES_H
#define SPLINES_H

#include <stddef.h>

/** Number i of intervals + 2 at x, 0 to intervals; together they are 1. Not 0 from i - 2 to i + 1. */
double spline(size_t i, double x);

#endif
