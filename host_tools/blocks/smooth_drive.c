/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "smooth_drive.h"
#include <math.h>

/* Least ratio of second differences. */
static const double nearly_the_same = 0.25;

bool smooth_drive(const double x[4]) {
    const double one = x[0] - 2.0 * x[1] + x[2], other = x[1] - 2.0 * x[2] + x[3];
    const double smaller = fmin(fabs(one), fabs(other)), larger = fmax(fabs(one), fabs(other));
    return one * other > 0.0 && smaller > nearly_the_same * larger;
}
