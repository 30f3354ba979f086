/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "smooth_drive.h"

/* Likeness of the second differences at which the cubic begins to count, and at which it is all. It is 0.47 if one is a
 * quarter of the other, 0.8 if it is half, as at the end of a rounded step. */
static const double begins = 0.2, all = 0.7;

double smooth_drive(const double x[4]) {
    const double one = x[0] - 2.0 * x[1] + x[2], other = x[1] - 2.0 * x[2] + x[3];
    const double squares = one * one + other * other;
    const double likeness = squares > 0.0 ? 2.0 * one * other / squares : 0.0;
    const double part = (likeness - begins) / (all - begins);
    return part <= 0.0 ? 0.0 : part >= 1.0 ? 1.0 : part * part * (3.0 - 2.0 * part);
}
