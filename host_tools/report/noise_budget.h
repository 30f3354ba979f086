/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * What a model's residual is made of, over frequency: a share for each block that was found, the noise, and what is
 * unexplained (after pygwinc's budgets of gravitational-wave detectors).
 *
 * The residual is that of the model before anything was found. A block's share is what the model loses without it, its
 * hysteresis fitted again. What the model with all of them leaves beyond the noise is unexplained; where that is less
 * than three of its standard errors, it is not told apart from the noise and counts as 0. The total is the root of the
 * sum of the squares: shares that are alike, or that act against each other, do not add up to the residual.
 */
#ifndef NOISE_BUDGET_H
#define NOISE_BUDGET_H

#include "diagnosis/diagnose.h"
#include <stdio.h>

typedef struct {
    const double *residual_um, *left_um; /**< recorded less the model: before, and with all that was found */
    size_t shares;
    const double *share_um[DIAGNOSIS_MOST_FINDINGS];
    const char *name[DIAGNOSIS_MOST_FINDINGS];
    size_t samples;
    double sample_rate_hz;
    const noise_t *noise; /**< NULL: not known; all that is left is then unexplained */
} budget_input_t;

/** Root mean squares in um within a band. */
typedef struct {
    double low_hz, high_hz;
    double residual_um, noise_um, unexplained_um, total_um;
    double share_um[DIAGNOSIS_MOST_FINDINGS];
} budget_band_t;

enum { BUDGET_MOST_BANDS = 12 };

typedef struct {
    size_t bands; /**< decades, with rising frequency; the first from one over the duration on */
    budget_band_t band[BUDGET_MOST_BANDS];
    budget_band_t all; /**< of all bands together */
} noise_budget_t;

/** samples >= 16. */
void noise_budget(const budget_input_t *input, noise_budget_t *budget);

/** As a figure and a table. */
void noise_budget_write(FILE *file, const budget_input_t *input);

#endif
