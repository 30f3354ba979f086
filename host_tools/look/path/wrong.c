/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "look/path/wrong.h"
#include "thresholds/thresholds.h"
#include <gsl/gsl_sort.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { WINDOW = 7, HALF = WINDOW / 2 };
/* Of normal noise, the scale of an exponential through its 90 and 98 % quantiles, in deviations; rounding makes 0.29 of
 * a step. */
static const double normal_scale = 0.423, rounding = 0.29;

/* Takes out of seven values their straight line: the median of the slopes between any two, which one or two wrong
 * values do not turn. */
static void take_line_out(double seven[WINDOW]) {
    double slope[WINDOW * (WINDOW - 1) / 2];
    size_t count = 0;
    for (size_t i = 0; i < WINDOW; i++) {
        for (size_t l = i + 1; l < WINDOW; l++) {
            slope[count++] = (seven[l] - seven[i]) / (double)(l - i);
        }
    }
    const double middle = look_quantile(slope, count, 0.5);
    for (size_t i = 0; i < WINDOW; i++) {
        seven[i] -= middle * ((double)i - HALF);
    }
}

/* Distance of value[k] from the median of seven beside their line, less what a corner of the motion there makes of it:
 * 0 or more. */
static double beyond_motion(const double *value, size_t k) {
    double seven[WINDOW], ways[WINDOW - 1];
    for (size_t i = 0; i < WINDOW; i++) {
        seven[i] = value[k + i - HALF];
    }
    take_line_out(seven);
    const double here = seven[HALF];
    for (size_t i = 0; i + 1 < WINDOW; i++) {
        ways[i] = fabs(seven[i + 1] - seven[i]);
    }
    gsl_sort(seven, 1, WINDOW);
    gsl_sort(ways, 1, WINDOW - 1);
    return fmax(0.0, fabs(here - seven[HALF]) - threshold.corner * 0.5 * (ways[2] + ways[3]));
}

/* Tail of the prediction's errors: the chance of an error above x is (1 - tail_to) exp(-(x - at) / scale). */
static bool tail_of(const prediction_t *p, double step_um, double *at, double *scale) {
    double *size = allocate(p->samples, sizeof *size);
    size_t count = 0;
    for (size_t k = 0; k < p->samples; k++) {
        if (p->quiet[k] != 0) {
            size[count++] = fabs(p->error[k]);
        }
    }
    if ((double)count >= threshold.least_for_tail) {
        const double inner = look_quantile(size, count, threshold.tail_from);
        *at = look_quantile(size, count, threshold.tail_to);
        *scale = (*at - inner) / log((1.0 - threshold.tail_from) / (1.0 - threshold.tail_to));
        *scale = fmax(*scale, normal_scale * fmax(p->sigma_um, rounding * step_um));
    }
    free(size);
    return (double)count >= threshold.least_for_tail && *scale > 0.0;
}

void wrong_find(const recording_t *recording, const drive_look_t *drive, const static_map_t *map,
                const noise_look_t *noise, const prediction_t *p, double log_chance_limit, wrong_t *wrong) {
    const double *y = recording->column[COLUMN_DISPLACEMENT], *u = recording->column[COLUMN_DRIVE];
    const double gain = fabs(map->gain_um_per_v);
    double at = 0.0, scale = 0.0, surest = 0.0;
    memset(wrong, 0, sizeof *wrong);
    if (!tail_of(p, fmax(noise->step_um, noise->digit_um), &at, &scale)) {
        return;
    }
    const double places = log10((double)p->samples * (1.0 - threshold.tail_to));
    for (size_t k = HALF; k + HALF < p->samples; k++) {
        const double beyond =
            beyond_motion(y, k) -
            threshold.drive_makes * gain * (beyond_motion(u, k) + threshold.edge_of_noise * drive->noise_v);
        /* Neither the prediction's error, which wrong readings nearby spoil, nor the distance alone. */
        const double error = fabs(p->error[k]), size = fmin(error, beyond);
        const double log_chance = places - (size - at) / scale / log(10.0);
        if (p->quiet[k] != 0 && log_chance < log_chance_limit) {
            wrong->at = reallocate(wrong->at, wrong->count + 1, sizeof *wrong->at);
            wrong->at[wrong->count++] = k;
            /* With no other one so near that it spoils the error, the error is the size: the distance has lost what a
             * corner might have made. */
            const bool alone = wrong->count < 2 || wrong->at[wrong->count - 2] + HALF < k;
            wrong->largest_um = fmax(wrong->largest_um, alone ? error : size);
            surest = fmax(surest, size);
            wrong->log_chance = fmin(wrong->log_chance, log_chance);
        }
    }
    wrong->scales = surest / scale;
}

void wrong_free(wrong_t *wrong) {
    free(wrong->at);
    memset(wrong, 0, sizeof *wrong);
}
