/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Least-squares fit of a sine to uniform samples: the four-parameter fit of IEEE 1057. */
#ifndef SINE_FIT_H
#define SINE_FIT_H

#include "base/failure.h"

/** offset + amplitude sin(2 pi frequency_hz k / sample_rate_hz + phase), k = 0, 1, ... */
typedef struct {
    double frequency_hz, offset, amplitude; /**< amplitude > 0 */
    double phase;                           /**< rad, in (-pi, pi] */
    double rms;                             /**< of the residuals */
} sine_t;

/** Estimates the frequency, too. Fails if the samples cross their mean fewer than two times, or if the search diverges:
 * they do not resemble a sine. */
bool sine_fit(const double *value, size_t count, double sample_rate_hz, sine_t *sine, failure_t *failure);

/** The same with a known frequency. count >= 3 samples, not all at the same phase. */
bool sine_fit_at(const double *value, size_t count, double sample_rate_hz, double frequency_hz, sine_t *sine,
                 failure_t *failure);

#endif
