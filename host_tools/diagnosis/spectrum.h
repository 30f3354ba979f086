/* SPDX-License-Identifier: GPL-3.0-or-later */
/** How the energy of a signal is spread over frequencies. */
#ifndef SPECTRUM_H
#define SPECTRUM_H

#include <stddef.h>

typedef struct {
    size_t count;   /**< frequencies, from 0 to half the sample rate */
    double step_hz; /**< from one to the next */
    /** Sum of squares of the signal that belongs to each: they add up to all of it, on average over its place under the
     * window. */
    double *energy;
    double white; /**< what white noise of deviation 1 has at each frequency but the first and the last (half) */
} spectrum_t;

/** The periodogram under Hann's window, at least as fine as the signal is long. samples >= 4. Free it. */
void spectrum_of(const double *signal, size_t samples, double sample_rate_hz, spectrum_t *spectrum);

void spectrum_free(spectrum_t *spectrum);

#endif
