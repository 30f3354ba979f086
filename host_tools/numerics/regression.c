/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "numerics/regression.h"
#include "base/failure.h"
#include "numerics/autocorrelation.h"
#include "numerics/spectrum.h"
#include <gsl/gsl_cblas.h>
#include <gsl/gsl_cdf.h>
#include <gsl/gsl_math.h>
#include <stdlib.h>
#include <string.h>

enum { BINS = 720 };
/* Independent frequencies in a spectrum through Hann's window, in parts of the length of its transform over the
 * samples. */
static const double window_width = 1.5;

typedef struct {
    double variance, degrees; /* of sum x rest */
} product_t;

/* From the scatter over bins of time: wherever the rest is large when x is. */
static product_t over_time(const double *x, const double *rest, size_t count) {
    double bin[BINS] = {0.0}, scatter = 0.0;
    for (size_t k = 0; k < count; k++) {
        bin[k * BINS / count] += x[k] * rest[k];
    }
    for (size_t b = 0; b < BINS; b++) {
        scatter += bin[b] * bin[b];
    }
    const residual_run_t run = {.value = bin, .samples = BINS};
    const double together = autocorrelation_time(&run, 1);
    return (product_t){scatter * together, GSL_MIN((double)count, BINS) / together};
}

/* From both spectra: the frequencies of one series have any phase to those of the other. Each of them counts for what
 * both have there. */
static product_t over_frequency(const double *x, const double *rest, size_t count) {
    spectrum_t one, other;
    double sum = 0.0, squares = 0.0;
    spectrum_of(x, count, 1.0, &one);
    spectrum_of(rest, count, 1.0, &other);
    const double finer = 2.0 / one.white;
    for (size_t f = 0; f < one.count; f++) {
        const double product = one.energy[f] * other.energy[f];
        sum += product;
        squares += product * product;
    }
    spectrum_free(&one);
    spectrum_free(&other);
    const double independent = squares > 0.0 ? sum * sum / (squares * window_width * finer) : 1.0;
    return (product_t){0.5 * finer * sum, 2.0 * independent};
}

regression_t regression_of(const double *x, const double *y, size_t count) {
    regression_t r = {
        .sigma = HUGE_VAL, .degrees = 1.0, .square = count > 0 ? cblas_ddot((int)count, x, 1, x, 1) : 0.0};
    if (r.square <= 0.0) {
        return r;
    }
    double *rest = allocate(count, sizeof(double));
    r.amplitude = cblas_ddot((int)count, x, 1, y, 1) / r.square;
    memcpy(rest, y, count * sizeof(double));
    cblas_daxpy((int)count, -r.amplitude, x, 1, rest, 1);
    const product_t time = over_time(x, rest, count), frequency = over_frequency(x, rest, count);
    free(rest);
    r.degrees = fmax(1.0, fmin(time.degrees, frequency.degrees) - 1.0);
    r.sigma = sqrt(fmax(time.variance, frequency.variance) * (1.0 + 1.0 / r.degrees)) / r.square;
    return r;
}

double regression_quantile(const regression_t *regression, double chance) {
    return gsl_cdf_tdist_Qinv(0.5 * chance, regression->degrees);
}
