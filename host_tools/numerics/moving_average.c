/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "numerics/moving_average.h"

void moving_average(double *values, size_t samples, size_t length) {
    double sum = 0.0;
    for (size_t k = 0; k < length; k++) {
        sum += values[k];
    }
    for (size_t k = 0; k + length < samples; k++) {
        const double leaving = values[k];
        values[k] = sum / (double)length;
        sum += values[k + length] - leaving;
    }
    values[samples - length] = sum / (double)length;
}
