/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "report/density.h"
#include "base/failure.h"
#include "numerics/spectrum.h"
#include <math.h>
#include <stdlib.h>

density_t density_of(const double *signal, size_t samples, double sample_rate_hz) {
    static const double band = 1.0594630943592953; /* 2^(1/12) */
    spectrum_t s;
    spectrum_of(signal, samples, sample_rate_hz, &s);
    density_t d = {allocate(s.count, sizeof(double)), allocate(s.count, sizeof(double)), 0};
    for (size_t f = 2, next; f < s.count; f = next) {
        double energy = 0.0;
        for (next = f; next < s.count && (next == f || (double)next < band * (double)f); next++) {
            energy += s.energy[next];
        }
        if (energy > 0.0) {
            d.hz[d.count] = s.step_hz * 0.5 * (double)(f + next - 1);
            d.density[d.count++] = sqrt(energy / ((double)(next - f) * s.white) / (0.5 * sample_rate_hz));
        }
    }
    spectrum_free(&s);
    return d;
}

double density_of_noise(const noise_t *noise, double frequency_hz, double sample_rate_hz) {
    return noise->sigma_um *
           sqrt(noise_filter_power(&noise->filter, frequency_hz / sample_rate_hz) / (0.5 * sample_rate_hz));
}

density_t density_of_noise_at(const noise_t *noise, const density_t *other, double sample_rate_hz) {
    density_t d = {allocate(other->count, sizeof(double)), allocate(other->count, sizeof(double)), 0};
    for (size_t f = 0; f < other->count; f++) {
        const double density = density_of_noise(noise, other->hz[f], sample_rate_hz);
        if (density > 0.0) {
            d.hz[d.count] = other->hz[f];
            d.density[d.count++] = density;
        }
    }
    return d;
}

void density_free(density_t *density) {
    free(density->hz);
    free(density->density);
}
