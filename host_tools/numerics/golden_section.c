/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "numerics/golden_section.h"
#include <math.h>

bool golden_section(golden_function_t *function, void *context, double low, double high, int steps, double *x) {
    const double golden = 0.5 * (sqrt(5.0) - 1.0);
    double inner[2] = {high - golden * (high - low), low + golden * (high - low)}, value[2];
    if (!function(context, inner[0], &value[0]) || !function(context, inner[1], &value[1])) {
        return false;
    }
    for (int i = 0; i < steps; i++) {
        const int fresh = value[0] < value[1] ? 0 : 1;
        if (fresh == 0) {
            high = inner[1];
            inner[1] = inner[0];
            value[1] = value[0];
            inner[0] = high - golden * (high - low);
        } else {
            low = inner[0];
            inner[0] = inner[1];
            value[0] = value[1];
            inner[1] = low + golden * (high - low);
        }
        if (!function(context, inner[fresh], &value[fresh])) {
            return false;
        }
    }
    *x = 0.5 * (low + high);
    return true;
}
