/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/noise/lines.h"
#include "numerics/spectrum.h"
#include "thresholds/thresholds.h"
#include <gsl/gsl_statistics_double.h>
#include <math.h>
#include <string.h>

enum { AROUND = 40 };

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
    if (length < 4) {
        return 0;
    }
    spectrum_t spectrum;
    spectrum_of(signal, length, sample_rate_hz, &spectrum);
    const double *power = spectrum.energy;
    for (size_t f = 3; f + 3 < spectrum.count; f++) {
        if (power[f] > power[f - 1] && power[f] >= power[f + 1]) {
            const double ratio = power[f] / median_around(power, f, spectrum.count - 1);
            if (ratio > threshold.line_stands_out) {
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
                    hz[at] = top * spectrum.step_hz;
                    lines += lines < LINES_MOST ? 1 : 0;
                }
            }
        }
    }
    spectrum_free(&spectrum);
    return lines;
}
