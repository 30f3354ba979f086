/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "numerics/spectrum.h"
#include "base/failure.h"
#include <gsl/gsl_fft_real.h>
#include <gsl/gsl_math.h>
#include <math.h>
#include <stdlib.h>

void spectrum_of(const double *signal, size_t samples, double sample_rate_hz, spectrum_t *spectrum) {
    size_t length = 4;
    double window_square = 0.0, *x;
    while (length < samples) {
        length *= 2;
    }
    x = allocate(length, sizeof(double)); /* zeros behind the signal */
    for (size_t k = 0; k < samples; k++) {
        const double window = 0.5 - 0.5 * cos(2.0 * M_PI * ((double)k + 0.5) / (double)samples);
        x[k] = signal[k] * window;
        window_square += window * window;
    }
    gsl_fft_real_radix2_transform(x, 1, length);
    spectrum->count = length / 2 + 1;
    spectrum->step_hz = sample_rate_hz / (double)length;
    spectrum->energy = allocate(spectrum->count, sizeof(double));
    const double scale = (double)samples / (window_square * (double)length);
    for (size_t f = 0; f < spectrum->count; f++) {
        const double real = x[f], imaginary = f == 0 || f == length / 2 ? 0.0 : x[length - f];
        const double sides = f == 0 || f == length / 2 ? 1.0 : 2.0;
        spectrum->energy[f] = sides * scale * (real * real + imaginary * imaginary);
    }
    spectrum->white = 2.0 * (double)samples / (double)length;
    free(x);
}

void spectrum_free(spectrum_t *spectrum) {
    free(spectrum->energy);
    spectrum->energy = NULL;
}
