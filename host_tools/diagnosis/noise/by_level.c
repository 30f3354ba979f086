/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/noise/by_level.h"
#include "thresholds/thresholds.h"
#include <math.h>

enum { LEVELS = 48, WAYS = 2 /* falling, rising */, LEAST_SAMPLES = 20 };

typedef struct {
    double sum, count;
} mean_t;

static void find_range(const samples_t *samples, const double *position, double range[2]) {
    range[0] = HUGE_VAL;
    range[1] = -HUGE_VAL;
    for (size_t k = 0; k < samples->all; k++) {
        if (samples->part[k] != SAMPLE_LEFT_OUT) {
            range[0] = fmin(range[0], position[k]);
            range[1] = fmax(range[1], position[k]);
        }
    }
}

static void take_means(const samples_t *samples, const double range[2], const double *position, const double *white,
                       mean_t mean[WAYS][LEVELS]) {
    size_t way = 0;
    for (size_t k = 1; k < samples->all; k++) {
        way = position[k] > position[k - 1] ? 1 : position[k] < position[k - 1] ? 0 : way;
        if (samples->part[k] != SAMPLE_LEFT_OUT && range[1] > range[0]) {
            const size_t level = (size_t)(LEVELS * (position[k] - range[0]) / (range[1] - range[0]));
            mean_t *here = &mean[way][level < LEVELS ? level : LEVELS - 1];
            here->sum += white[k];
            here->count += 1.0;
        }
    }
}

/* The run of levels whose sum, each less what chance and a part of the mean share give it, is largest. */
static void find_levels(const double beyond[LEVELS], double all, const double range[2], by_level_t *found) {
    const double least = threshold.worth_adding * all / LEVELS, step_um = (range[1] - range[0]) / LEVELS;
    double run = 0.0, most = 0.0;
    size_t first = 0;
    for (size_t level = 0; level < LEVELS; level++) {
        if (run <= 0.0) {
            run = 0.0;
            first = level;
        }
        run += beyond[level] - least;
        if (run > most) {
            most = run;
            found->low_um = range[0] + step_um * (double)first;
            found->high_um = range[0] + step_um * (double)(level + 1);
        }
    }
}

by_level_t by_level(const samples_t *samples, double sigma_um, const double *position, const double *white) {
    by_level_t found = {0};
    mean_t mean[WAYS][LEVELS] = {{{0}}};
    double range[2], beyond[LEVELS] = {0.0}, all = 0.0, means = 0.0, counted = 0.0;
    find_range(samples, position, range);
    take_means(samples, range, position, white, mean);
    for (size_t i = 0; i < WAYS * (size_t)LEVELS; i++) {
        const mean_t *here = &mean[i / LEVELS][i % LEVELS];
        if (here->count >= LEAST_SAMPLES) {
            const double square = here->sum * here->sum / (here->count * sigma_um * sigma_um) - 1.0;
            beyond[i % LEVELS] += square;
            all += square;
            means += 1.0;
            counted += here->count;
        }
    }
    if (all > threshold.beyond_chance * sqrt(2.0 * means)) {
        found.part = sqrt(all / counted);
        find_levels(beyond, all, range, &found);
    }
    return found;
}
