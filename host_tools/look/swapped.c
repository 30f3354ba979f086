/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "look/swapped.h"
#include "look/look.h"
#include "thresholds/thresholds.h"
#include <math.h>

/* At how many levels of the drive the branches stand one way round, less those the other way. */
static double orientation(const static_map_t *map) {
    double sum = 0.0;
    for (size_t i = 0; i < map->levels; i++) {
        const double width = (map->falling_um[i] - map->rising_um[i]) * (map->gain_um_per_v < 0.0 ? -1.0 : 1.0);
        sum += width > 0.0 ? 1.0 : width < 0.0 ? -1.0 : 0.0;
    }
    return sum;
}

recording_t swapped_turned(const recording_t *recording) {
    recording_t turned = *recording;
    turned.column[COLUMN_DRIVE] = recording->column[COLUMN_DISPLACEMENT];
    turned.column[COLUMN_DISPLACEMENT] = recording->column[COLUMN_DRIVE];
    return turned;
}

void swapped_look(const recording_t *recording, const drive_look_t *drive, const static_map_t *map,
                  const prediction_t *prediction, swapped_t *swapped) {
    const double levels = (double)map->levels, sum = orientation(map);
    const double range_v = drive->range_v[1] - drive->range_v[0], stroke_um = map->stroke_um[1] - map->stroke_um[0];
    /* Each level's sign would be either with the same chance. */
    *swapped = (swapped_t){
        .levels = levels, .turned = -sum, .log_chance = 1.0 - (levels + sum < 1.0 ? levels : -sum) * log10(2.0) - 0.5};
    if (levels < threshold.levels_of_loop || swapped->turned < threshold.levels_turned * levels ||
        drive->kind == DRIVE_RESTS) {
        return;
    }
    const recording_t turned = swapped_turned(recording);
    drive_look_t no_steps = {.range_v = {map->stroke_um[0], map->stroke_um[1]}};
    prediction_t back;
    prediction_make(&turned, &no_steps, &back);
    swapped->noise_v = back.noise_um;
    prediction_free(&back);
    swapped->suspected = swapped->noise_v / range_v > threshold.more_exact * prediction->noise_um / stroke_um &&
                         swapped->log_chance < look_log_chance_limit();
}

bool swapped_suspected(const recording_t *recording) {
    drive_look_t drive;
    static_map_t map;
    prediction_t prediction;
    swapped_t swapped;
    failure_t ignored;
    if (recording->samples < LOOK_LEAST_SAMPLES || !drive_look(recording, &drive, &ignored)) {
        return false;
    }
    static_map_look(recording, &drive, &map);
    prediction_make(recording, &drive, &prediction);
    swapped_look(recording, &drive, &map, &prediction, &swapped);
    prediction_free(&prediction);
    drive_look_free(&drive);
    return swapped.suspected;
}
