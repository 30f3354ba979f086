/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Power spectral densities for pictures: one-sided, their roots in um per root hertz. */
#ifndef DENSITY_H
#define DENSITY_H

#include "diagnosis/noise/noise.h"

/** A line of positive points, over bands of a twelfth of an octave. */
typedef struct {
    double *hz, *density;
    size_t count;
} density_t;

/** Of a signal; to be freed. */
density_t density_of(const double *signal, size_t samples, double sample_rate_hz);

/** Of the noise at one frequency, and at those of another density; to be freed. */
double density_of_noise(const noise_t *noise, double frequency_hz, double sample_rate_hz);
density_t density_of_noise_at(const noise_t *noise, const density_t *other, double sample_rate_hz);

void density_free(density_t *density);

#endif
