/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Integrated autocorrelation time of residuals, by whose square root standard errors are widened. */
#ifndef AUTOCORRELATION_H
#define AUTOCORRELATION_H

#include <stddef.h>

/** Residuals in time order, without a gap. */
typedef struct {
    const double *value;
    size_t samples;
} residual_run_t;

/**
 * Integrated autocorrelation time in samples, tau = 1 + 2 sum rho(l), over all lags up to Sokal's window (6 times the
 * sum so far, at most a quarter of the longest run). Products are taken inside one run only. At least 1; white
 * residuals have 1. That many neighbouring samples count as one independent sample.
 */
double autocorrelation_time(const residual_run_t *run, size_t count);

#endif
