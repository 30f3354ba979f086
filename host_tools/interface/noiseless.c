/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "interface/noiseless.h"
#include "thresholds/thresholds.h"
#include <gsl/gsl_randist.h>
#include <gsl/gsl_rng.h>
#include <gsl/gsl_statistics_double.h>
#include <math.h>
#include <stdlib.h>

/* Of white noise that would make such third differences, half of which are below 0.6745 deviations of sqrt 20. */
static double deviation_um(const double *y, size_t samples) {
    double *size = allocate(samples, sizeof *size);
    for (size_t k = 0; k + 3 < samples; k++) {
        size[k] = fabs(y[k + 3] - 3.0 * y[k + 2] + 3.0 * y[k + 1] - y[k]);
    }
    const double median = gsl_stats_median(size, 1, samples - 3);
    free(size);
    return median / (0.6745 * sqrt(20.0));
}

/* What else differs in rests and between passes, as a creep, is no noise of neighbours. */
static double white_um(const recording_t *recording, const noise_look_t *noise) {
    const double rest_um = noise->rest.samples > 0 ? noise->rest.white_um : HUGE_VAL,
                 repeat_um = noise->repeat.samples > 0 ? noise->repeat.white_um : HUGE_VAL;
    return isfinite(rest_um) || isfinite(repeat_um)
               ? fmin(rest_um, repeat_um)
               : deviation_um(recording->column[COLUMN_DISPLACEMENT], recording->samples);
}

static bool is_noiseless(const recording_t *recording, const noise_look_t *noise, double range_um) {
    const double least_um = 0.01 * threshold.least_noise_percent * range_um;
    return noise->digit_um < least_um && noise->step_um < least_um && white_um(recording, noise) < least_um;
}

double noiseless_add(recording_t *recordings, const look_t *looks, size_t count) {
    double added_percent = 0.0, range[2];
    for (size_t i = 0; i < count; i++) {
        double *y = recordings[i].column[COLUMN_DISPLACEMENT];
        recordings_range(&recordings[i], 1, COLUMN_DISPLACEMENT, range);
        if (range[1] > range[0] && is_noiseless(&recordings[i], &looks[i].noise, range[1] - range[0])) {
            gsl_rng *random = gsl_rng_alloc(gsl_rng_taus2);
            gsl_rng_set(random, 1 + i);
            for (size_t k = 0; k < recordings[i].samples; k++) {
                y[k] += gsl_ran_gaussian(random, 0.01 * threshold.added_noise_percent * (range[1] - range[0]));
            }
            gsl_rng_free(random);
            added_percent = threshold.added_noise_percent;
        }
    }
    return added_percent;
}
