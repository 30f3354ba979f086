/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "numerics/between.h"
#include <math.h>

double value_between(const double *value, size_t samples, double at) {
    const double whole = floor(at), x = at - whole;
    const size_t k = (size_t)whole;
    if (x == 0.0 || k + 1 >= samples) {
        return value[k < samples ? k : samples - 1];
    }
    if (k == 0 || k + 2 >= samples) {
        return value[k] + x * (value[k + 1] - value[k]);
    }
    const double a = value[k - 1], b = value[k], c = value[k + 1], d = value[k + 2];
    return b + 0.5 * x * (c - a + x * (2.0 * a - 5.0 * b + 4.0 * c - d + x * (3.0 * (b - c) + d - a)));
}

double value_between_variance(double part) {
    const double x = part, a = 0.5 * x * (-1.0 + x * (2.0 - x)), d = 0.5 * x * x * (x - 1.0);
    const double b = 1.0 + 0.5 * x * x * (3.0 * x - 5.0), c = 0.5 * x * (1.0 + x * (4.0 - 3.0 * x));
    return a * a + b * b + c * c + d * d;
}
