/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "regression.h"
#include "autocorrelation.h"
#include <gsl/gsl_cblas.h>
#include <gsl/gsl_cdf.h>
#include <gsl/gsl_math.h>

enum { BINS = 720 };

regression_t regression_of(const double *x, const double *y, size_t count) {
    regression_t r = {
        .sigma = HUGE_VAL, .degrees = 1.0, .square = count > 0 ? cblas_ddot((int)count, x, 1, x, 1) : 0.0};
    double bin[BINS] = {0.0}, squares = 0.0, scatter = 0.0;
    if (r.square <= 0.0) {
        return r;
    }
    r.amplitude = cblas_ddot((int)count, x, 1, y, 1) / r.square;
    for (size_t k = 0; k < count; k++) {
        const double rest = y[k] - r.amplitude * x[k];
        bin[k * BINS / count] += x[k] * rest;
        squares += rest * rest;
    }
    for (size_t b = 0; b < BINS; b++) {
        scatter += bin[b] * bin[b];
    }
    const residual_run_t run = {.value = bin, .samples = BINS};
    const double together = autocorrelation_time(&run, 1), independent = GSL_MIN((double)count, BINS) / together;
    r.degrees = fmax(1.0, independent - 1.0);
    r.sigma = sqrt(fmax(squares * r.square / (double)count, scatter * together)) / r.square;
    return r;
}

double regression_quantile(const regression_t *regression, double chance) {
    return gsl_cdf_tdist_Qinv(0.5 * chance, regression->degrees);
}
