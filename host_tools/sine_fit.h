/* SPDX-License-Identifier: GPL-3.0-or-later */
/** The sine that comes nearest to a run of samples: IEEE 1057's four-parameter fit. */
#ifndef SINE_FIT_H
#define SINE_FIT_H

#include "failure.h"

/** offset + amplitude sin(2 pi frequency_hz k / sample_rate_hz + phase), k = 0, 1, ... */
typedef struct {
    double frequency_hz, offset, amplitude; /**< amplitude > 0 */
    double phase;                           /**< rad, in (-pi, pi] */
    double rms;                             /**< of what is left */
} sine_t;

/** Frequency, too, is found. Fails on fewer than two passages through the mean, or where the search runs away: nothing
 * that resembles a sine. */
bool sine_fit(const double *value, size_t count, double sample_rate_hz, sine_t *sine, failure_t *failure);

/** The same with a known frequency. count >= 3 samples, not all at the same phase. */
bool sine_fit_at(const double *value, size_t count, double sample_rate_hz, double frequency_hz, sine_t *sine,
                 failure_t *failure);

#endif
