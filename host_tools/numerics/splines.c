/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "numerics/splines.h"

double spline(size_t i, double x) {
    const double t = x - (double)i + 2.0;
    if (t <= 0.0 || t >= 3.0) {
        return 0.0;
    }
    return t < 1.0 ? 0.5 * t * t : t < 2.0 ? 0.75 - (t - 1.5) * (t - 1.5) : 0.5 * (3.0 - t) * (3.0 - t);
}
