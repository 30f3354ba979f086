/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "lines.h"
#include "failure.h"
#include <gsl/gsl_fft_real.h>
#include <gsl/gsl_math.h>
#include <gsl/gsl_statistics_double.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { AROUND = 40 };
static const double stands_out = 20.0;

/* Power by frequency of the largest power of two of samples, windowed. */
static double *spectrum(const double *signal, size_t length) {
    double *x = allocate(length, sizeof(double));
    for (size_t k = 0; k < length; k++) {
        x[k] = signal[k] * (1.0 - cos(2.0 * M_PI * (double)k / (double)length));
    }
    gsl_fft_real_radix2_transform(x, 1, length);
    for (size_t f = 1; f < length / 2; f++) {
        x[f] = x[f] * x[f] + x[length - f] * x[length - f];
    }
    return x;
}

static double median_around(const double *power, size_t f, size_t count) {
    double around[2 * AROUND + 1];
    const size_t from = f > AROUND ? f - AROUND : 1, to = f + AROUND < count ? f + AROUND : count - 1;
    memcpy(around, power + from, (to - from + 1) * sizeof(double));
    return gsl_stats_median(around, 1, to - from + 1);
}

size_t find_lines(const double *signal, size_t samples, double sample_rate_hz, double hz[LINES_MOST]) {
    size_t length = 1, lines = 0;
    double height[LINES_MOST + 1];
    while (2 * length <= samples) {
        length *= 2;
    }
    double *power = spectrum(signal, length);
    for (size_t f = 3; f + 2 < length / 2; f++) {
        if (power[f] > power[f - 1] && power[f] >= power[f + 1]) {
            const double ratio = power[f] / median_around(power, f, length / 2);
            if (ratio > stands_out) {
                /* Between the bins, where the parabola through their logarithms has its top. */
                const double a = log(power[f - 1]), b = log(power[f]), c = log(power[f + 1]);
                const double top = (double)f + 0.5 * (a - c) / (a - 2.0 * b + c);
                size_t at = lines;
                while (at > 0 && height[at - 1] < ratio) {
                    if (at < LINES_MOST) {
                        height[at] = height[at - 1];
                        hz[at] = hz[at - 1];
                    }
                    at--;
                }
                if (at < LINES_MOST) {
                    height[at] = ratio;
                    hz[at] = top * sample_rate_hz / (double)length;
                    lines += lines < LINES_MOST ? 1 : 0;
                }
            }
        }
    }
    free(power);
    return lines;
}
