/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "look/signal/drive_before.h"
#include <math.h>

double drive_before(const double *u, size_t n, drive_between_t between, size_t k, double samples) {
    const double at = fmin(fmax((double)k - samples, 0.0), (double)(n - 1));
    const size_t i = (size_t)at;
    const double x = at - (double)i;
    if (between == BETWEEN_HELD || i + 1 >= n) {
        return u[i];
    }
    if (between == BETWEEN_SMOOTH && i >= 1 && i + 2 < n) { /* Lagrange's cubic */
        return u[i] * (1.0 - x) * (1.0 + x) * (2.0 - x) / 2.0 + u[i + 1] * x * (1.0 + x) * (2.0 - x) / 2.0 -
               (u[i - 1] * (1.0 - x) * (2.0 - x) + u[i + 2] * (1.0 + x) * (1.0 - x)) * x / 6.0;
    }
    return u[i] + x * (u[i + 1] - u[i]);
}
