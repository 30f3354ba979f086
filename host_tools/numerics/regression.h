/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Regression of one series on another, with a standard error that allows for autocorrelated residuals. */
#ifndef REGRESSION_H
#define REGRESSION_H

#include <stddef.h>

typedef struct {
    double amplitude; /**< y = amplitude x + residual, least squares; 0, and sigma HUGE_VAL, where x is 0 */
    double sigma;     /**< its standard error */
    double degrees;   /**< of freedom of that error, 1 or more */
    double square;    /**< of x: sum */
} regression_t;

/**
 * Regresses y on x. Both are in time order, orthogonal to the other regressors, and have a mean of about 0.
 *
 * The standard error is the larger of two estimates. The first assumes a white residual. The second comes from the sum
 * of x times residual in 720 time bins, whose scatter is widened by the bins' autocorrelation time (autocorrelation.h).
 * Two unrelated slow series resemble each other for a while. The products then keep their sign over many bins, and only
 * the number of independent bins counts, in `degrees` too.
 */
regression_t regression_of(const double *x, const double *y, size_t count);

/** Threshold of amplitude / standard error that chance exceeds with this probability, two-sided. */
double regression_quantile(const regression_t *regression, double chance);

#endif
