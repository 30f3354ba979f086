/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "numerics/autocorrelation.h"
#include <math.h>

double autocorrelation_time(const residual_run_t *run, size_t count) {
    double power = 0.0, time = 1.0;
    size_t longest = 0;
    for (size_t r = 0; r < count; r++) {
        longest = run[r].samples > longest ? run[r].samples : longest;
        for (size_t k = 0; k < run[r].samples; k++) {
            power += run[r].value[k] * run[r].value[k];
        }
    }
    for (size_t lag = 1; lag < longest / 4 && (double)lag < 6.0 * time && power > 0.0; lag++) {
        double sum = 0.0;
        for (size_t r = 0; r < count; r++) {
            for (size_t k = lag; k < run[r].samples; k++) {
                sum += run[r].value[k] * run[r].value[k - lag];
            }
        }
        time = fmax(time + 2.0 * sum / power, 1.0);
    }
    return time;
}
