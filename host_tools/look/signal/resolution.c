/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "look/signal/resolution.h"
#include "base/failure.h"
#include "look/signal/numbers.h"
#include "thresholds/thresholds.h"
#include <gsl/gsl_sort.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Values of the same level that a file or rounding of binary numbers keeps apart: this part of the range. */
static const double same = 1e-9;

/* Distinct levels of sorted values in place. */
static size_t distinct(double *sorted, size_t count) {
    const double least = same * (sorted[count - 1] - sorted[0]);
    size_t levels = 1;
    for (size_t k = 1; k < count; k++) {
        if (sorted[k] - sorted[levels - 1] > least) {
            sorted[levels++] = sorted[k];
        }
    }
    return levels;
}

/* Walks up the levels with a step that is refined on the way, so that its error never grows to half a step. */
static double refined(const double *level, size_t levels, double step) {
    double multiple = 0.0, good = 0.0;
    for (size_t i = 1; i < levels; i++) {
        const double jump = round((level[i] - level[i - 1]) / step);
        multiple += jump;
        good += fabs((level[i] - level[i - 1]) / step - jump) < threshold.lattice_tolerance * fmax(1.0, sqrt(jump))
                    ? 1.0
                    : 0.0;
        if (jump < 1.0) {
            return 0.0;
        }
        step = multiple >= threshold.fewest_distances ? (level[i] - level[0]) / multiple : step;
    }
    return good > threshold.on_the_lattice * (double)(levels - 1) ? (level[levels - 1] - level[0]) / multiple : 0.0;
}

/* The distinct values, ascending; to be freed. */
static double *levels_of(const double *value, size_t count, size_t *levels) {
    double *sorted = allocate(count, sizeof *sorted);
    memcpy(sorted, value, count * sizeof *sorted);
    gsl_sort(sorted, 1, count);
    *levels = distinct(sorted, count);
    return sorted;
}

/* The step between the distinct levels of so many values; 0 if there are not more levels than distances wanted. */
static double step_between(const double *level, size_t levels, size_t count, double fewest_distances) {
    const double again = (double)(count - levels);
    if ((double)levels <= fewest_distances ||
        (again < threshold.read_again && again < threshold.read_again_part * (double)count)) {
        return 0.0;
    }
    double *gap = allocate(levels - 1, sizeof *gap);
    for (size_t i = 0; i + 1 < levels; i++) {
        gap[i] = level[i + 1] - level[i];
    }
    /* The smallest distance of many is one step; a few odd ones (of a file that was put together) do not count. */
    const double step = refined(level, levels, look_quantile(gap, levels - 1, threshold.odd_distances));
    free(gap);
    return step;
}

double resolution_step(const double *value, size_t count) {
    size_t levels;
    double *level = levels_of(value, count, &levels);
    const double step = step_between(level, levels, count, threshold.fewest_distances);
    free(level);
    return step;
}

double resolution_step_of_reading(const double *reading, const double *drive, size_t count) {
    size_t levels, drives;
    double *level = levels_of(reading, count, &levels), fewest_distances = threshold.fewest_distances;
    if ((double)levels <= fewest_distances) {
        free(levels_of(drive, count, &drives));
        fewest_distances = (double)drives > threshold.drive_levels_beside * (double)levels
                               ? threshold.fewest_coarse_distances
                               : fewest_distances;
    }
    const double step = step_between(level, levels, count, fewest_distances);
    free(level);
    return step;
}

double resolution_digit(const double *value, size_t count) {
    enum { MOST_DIGITS = 9 };
    double unit = 1.0;
    size_t k = 0;
    for (int digits = 0; digits <= MOST_DIGITS; digits++) {
        /* What failed with fewer digits is behind; a value that is one still is with more. Binary numbers of this size
         * keep 2^-53 of it. */
        while (k < count && fabs(value[k] * unit - round(value[k] * unit)) <= 1e-15 * fabs(value[k] * unit) + 1e-9) {
            k++;
        }
        if (k == count) {
            return 1.0 / unit;
        }
        unit *= 10.0;
    }
    return 0.0;
}
