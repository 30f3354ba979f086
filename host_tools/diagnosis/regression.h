/* SPDX-License-Identifier: GPL-3.0-or-later */
/** How much of one series stands in another one, and how sure that is when neighbours are not independent. */
#ifndef REGRESSION_H
#define REGRESSION_H

#include <stddef.h>

typedef struct {
    double amplitude; /**< y = amplitude x + rest, least squares; 0, and sigma HUGE_VAL, where x is 0 */
    double sigma;     /**< its standard error */
    double degrees;   /**< of freedom of that error, 1 or more */
    double square;    /**< of x: sum */
} regression_t;

/**
 * In time order, both less what else explains them, and of mean 0 or nearly so.
 *
 * The standard error is the larger one of two: that of a white rest; and that from the sum of x rest, in 720 bins of
 * time, whose scatter is widened by the bins' autocorrelation time (autocorrelation.h). Two slow series that have
 * nothing to do with each other resemble each other for a while: the products then keep their sign over many bins, and
 * it is the number of independent ones that counts, in `degrees` too.
 */
regression_t regression_of(const double *x, const double *y, size_t count);

/** amplitude over its standard error beyond which chance goes less often than this, either sign. */
double regression_quantile(const regression_t *regression, double chance);

#endif
