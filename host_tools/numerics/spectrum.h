/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Energy spectrum of a signal. */
#ifndef SPECTRUM_H
#define SPECTRUM_H

#include <stddef.h>

typedef struct {
    size_t count;   /**< frequencies, from 0 to half the sample rate */
    double step_hz; /**< spacing */
    /** Sum of squares of the signal at each frequency. They add up to that of the signal, on average over its position
     * under the window. */
    double *energy;
    double white; /**< energy of white noise of standard deviation 1 at each frequency; half of it at the first and the
                     last */
} spectrum_t;

/** The periodogram under a Hann window; its resolution is 1 / length of the signal or finer. samples >= 4. To be
 * freed. */
void spectrum_of(const double *signal, size_t samples, double sample_rate_hz, spectrum_t *spectrum);

void spectrum_free(spectrum_t *spectrum);

#endif
