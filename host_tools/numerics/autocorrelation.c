/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "numerics/autocorrelation.h"
#include <gsl/gsl_cblas.h>
#include <math.h>

/* Sum of the products of values that lie `lag` apart. */
static double products(const residual_run_t *run, size_t lag) {
    return lag < run->samples ? cblas_ddot((int)(run->samples - lag), run->value + lag, 1, run->value, 1) : 0.0;
}

double autocorrelation_time(const residual_run_t *run, size_t count) {
    double power = 0.0, time = 1.0;
    size_t longest = 0;
    for (size_t r = 0; r < count; r++) {
        longest = run[r].samples > longest ? run[r].samples : longest;
        power += products(&run[r], 0);
    }
    for (size_t lag = 1; lag < longest / 4 && (double)lag < 6.0 * time && power > 0.0; lag++) {
        double sum = 0.0;
        for (size_t r = 0; r < count; r++) {
            sum += products(&run[r], lag);
        }
        time = fmax(time + 2.0 * sum / power, 1.0);
    }
    return time;
}
