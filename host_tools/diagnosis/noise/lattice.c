/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/noise/lattice.h"
#include "thresholds/thresholds.h"
#include <gsl/gsl_fit.h>
#include <gsl/gsl_sort.h>
#include <gsl/gsl_statistics_double.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { FEWEST_LEVELS = 6 };

double lattice_likelihood_per_sample(void) {
    return -2.0 * log(2.0 * threshold.lattice_tolerance);
}

/* Sorted, without repetitions, and without what is masked: no converter read it. */
static size_t distinct(const recording_t *recording, double *level) {
    size_t read = 0, count = 0;
    for (size_t k = 0; k < recording->samples; k++) {
        if (recording->masked == NULL || recording->masked[k] == 0) {
            level[read++] = recording->column[COLUMN_DISPLACEMENT][k];
        }
    }
    gsl_sort(level, 1, read);
    for (size_t k = 0; k < read; k++) {
        if (count == 0 || level[k] > level[count - 1]) {
            level[count++] = level[k];
        }
    }
    return count;
}

static double step_of(const double *level, size_t levels, double *sigma_um) {
    double *number = allocate(levels, sizeof(double)), *gap = allocate(levels, sizeof(double));
    double at0, step, c00, c01, c11, squares;
    for (size_t i = 1; i < levels; i++) {
        gap[i - 1] = level[i] - level[i - 1];
    }
    gsl_sort(gap, 1, levels - 1);
    const double typical = gsl_stats_median_from_sorted_data(gap, 1, levels - 1);
    for (size_t i = 1; i < levels; i++) {
        number[i] = number[i - 1] + round((level[i] - level[i - 1]) / typical);
    }
    gsl_fit_linear(number, 1, level, 1, levels, &at0, &step, &c00, &c01, &c11, &squares);
    *sigma_um = sqrt(c11);
    for (size_t i = 0; i < levels; i++) {
        if (!(fabs(level[i] - at0 - step * number[i]) < threshold.lattice_tolerance * step)) {
            step = 0.0;
            break;
        }
    }
    free(number);
    free(gap);
    return step;
}

double lattice_step_um(const recording_t *recordings, size_t count, double *sigma_um) {
    double step = 0.0;
    for (size_t i = 0; i < count; i++) {
        const size_t samples = recordings[i].samples;
        double *level = allocate(samples, sizeof(double));
        const size_t levels = distinct(&recordings[i], level);
        const double own = levels < FEWEST_LEVELS || (double)levels * threshold.samples_per_reading > (double)samples
                               ? 0.0
                               : step_of(level, levels, sigma_um);
        free(level);
        if (own <= 0.0 || (i > 0 && fabs(own / step - 1.0) > threshold.lattice_tolerance)) {
            return 0.0;
        }
        step = own;
    }
    return step;
}

void lattice_visible_steps(const recording_t *recordings, size_t count, double range_um[2]) {
    range_um[0] = 0.0;
    range_um[1] = HUGE_VAL;
    for (size_t i = 0; i < count; i++) {
        const size_t samples = recordings[i].samples;
        double ends[2];
        values_range(recordings[i].column[COLUMN_DISPLACEMENT], samples, ends);
        range_um[0] = fmax(range_um[0], (ends[1] - ends[0]) * threshold.samples_per_reading / (double)samples);
        range_um[1] = fmin(range_um[1], (ends[1] - ends[0]) / (FEWEST_LEVELS - 1));
    }
}
