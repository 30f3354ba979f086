/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "look/path/static_map.h"
#include "thresholds/thresholds.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Median of the samples of one level that are on the rising (way 1) or falling (-1) branch. HUGE_VAL: too few. */
static double level_median(const double *u, const double *y, size_t samples, double from, double to, double way,
                           double still, double *picked) {
    size_t count = 0;
    double rising = 0.0;
    for (size_t k = 1; k < samples; k++) {
        const double change = u[k] - u[k - 1];
        rising = fabs(change) > still ? (change > 0.0 ? 1.0 : -1.0) : rising;
        if (rising == way && u[k] >= from && u[k] < to) {
            picked[count++] = y[k];
        }
    }
    return (double)count >= threshold.least_in_level ? look_quantile(picked, count, 0.5) : HUGE_VAL;
}

static void find_line(const double *u, const double *y, size_t samples, double middle_v, double half_v,
                      static_map_t *map) {
    double *columns = allocate(3 * samples, sizeof *columns);
    const double *const column[] = {columns, columns + samples, columns + 2 * samples};
    const double stroke = map->stroke_um[1] - map->stroke_um[0];
    look_regression_t fit;
    for (size_t k = 0; k < samples; k++) {
        const double x = (u[k] - middle_v) / half_v;
        columns[k] = 1.0;
        columns[samples + k] = x;
        columns[2 * samples + k] = x * x;
    }
    if (look_regress(column, 2, y, NULL, samples, &fit)) {
        map->gain_um_per_v = fit.coefficient[1] / half_v;
        map->offset_um = fit.coefficient[0] - map->gain_um_per_v * middle_v;
        map->line_error_percent = 100.0 * fit.rms / stroke;
    }
    if (look_regress(column, 3, y, NULL, samples, &fit)) {
        map->bend_percent = 100.0 * fit.coefficient[2] / stroke;
    }
    free(columns);
}

void static_map_look(const recording_t *recording, const drive_look_t *drive, static_map_t *map) {
    const double *u = recording->column[COLUMN_DRIVE], *y = recording->column[COLUMN_DISPLACEMENT];
    const size_t samples = recording->samples;
    const double low = drive->range_v[0], range_v = drive->range_v[1] - low;
    double *picked = allocate(samples, sizeof *picked), widest = 0.0;
    memset(map, 0, sizeof *map);
    values_range(y, samples, map->stroke_um);
    if (range_v > 0.0 && map->stroke_um[1] > map->stroke_um[0]) {
        find_line(u, y, samples, low + 0.5 * range_v, 0.5 * range_v, map);
        for (size_t i = 0; i < STATIC_LEVELS; i++) {
            const double from = low + range_v * (double)i / STATIC_LEVELS,
                         still = threshold.edge_of_noise * drive->noise_v;
            const double to = low + range_v * (double)(i + 1) / STATIC_LEVELS;
            const double up = level_median(u, y, samples, from, to, 1.0, still, picked);
            const double down = level_median(u, y, samples, from, to, -1.0, still, picked);
            if (isfinite(up) && isfinite(down)) {
                map->level_v[map->levels] = 0.5 * (from + to);
                map->rising_um[map->levels] = up;
                map->falling_um[map->levels++] = down;
                widest = fabs(down - up) > fabs(widest) ? down - up : widest;
            }
        }
        map->width_percent = 100.0 * fabs(widest) / (map->stroke_um[1] - map->stroke_um[0]);
        map->lags = widest * map->gain_um_per_v >= 0.0;
    }
    free(picked);
}
