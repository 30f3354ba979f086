/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "smooth_drive.h"
#include <math.h>

/* Least ratio of second differences, and the most that the newest deviates from what the others lead to. */
static const double least_ratio = 0.25, most_deviation = 0.25;

static bool nearly_the_same(double one, double other) {
    const double smaller = fmin(fabs(one), fabs(other)), larger = fmax(fabs(one), fabs(other));
    return one * other > 0.0 && smaller > least_ratio * larger;
}

bool smooth_drive(const double x[5]) {
    const double newest = x[0] - 2.0 * x[1] + x[2], middle = x[1] - 2.0 * x[2] + x[3],
                 oldest = x[2] - 2.0 * x[3] + x[4];
    return nearly_the_same(newest, middle) &&
           fabs(newest - 2.0 * middle + oldest) < most_deviation * fmax(fabs(newest), fabs(middle));
}
