/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * The parts of a tracking error, from the track alone.
 *
 * The error is regressed on the regressors of linear errors one after the other, so that the squares of the parts add
 * up to the square of the whole:
 *
 *     offset and gain    a + b * reference
 *     delay              c * d(reference)/dt          c > 0: the position is late by c
 *     noise              uncorrelated from sample to sample
 *     rest               all other: hysteresis, ringing, creep
 *
 * For a sine a resonance shows as gain and delay: at one frequency these cannot be distinguished.
 */
#ifndef ERROR_BUDGET_H
#define ERROR_BUDGET_H

#include <stddef.h>

typedef struct {
    double static_um; /**< RMS of the part that is offset and gain */
    double delay_um;  /**< RMS of the part that is delay */
    double delay_s;   /**< the delay */
    double noise_um;  /**< standard deviation of the noise, at most the residual of the parts above */
    double rest_um;
} error_budget_t;

/** At least 8 samples. */
error_budget_t error_budget(const double *reference_um, const double *position_um, size_t samples,
                            double sample_rate_hz);

#endif
