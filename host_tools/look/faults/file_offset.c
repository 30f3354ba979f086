/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Files of one question with different zeros. The middle between rising and falling branch is compared at the drives
 * that two files share, against the first file. The past of a hysteresis can move it by the width of a loop at most,
 * and the past may have been any that the drives of all files span: only what is beyond that counts. */
#include "look/fault.h"
#include "thresholds/thresholds.h"
#include <math.h>
#include <stdlib.h>

/* Middle of the branches at a drive, by a straight line between levels. false: outside. */
static bool middle_at(const static_map_t *map, double drive_v, double *middle) {
    for (size_t i = 1; i < map->levels; i++) {
        const double from = map->level_v[i - 1], to = map->level_v[i];
        if (drive_v >= from && drive_v <= to) {
            const double x = (drive_v - from) / (to - from);
            *middle = 0.5 * ((1.0 - x) * (map->rising_um[i - 1] + map->falling_um[i - 1]) +
                             x * (map->rising_um[i] + map->falling_um[i]));
            return true;
        }
    }
    return false;
}

/* Of the loop over all drives. With thresholds that are as dense everywhere it is wider by the square of its length
 * (Rayleigh), with a density that rises from 0 in proportion to them by the cube. */
static double width_of(const look_t *look, double all_v) {
    const static_map_t *map = &look->map;
    const double own_v = look->drive.range_v[1] - look->drive.range_v[0];
    return 0.01 * map->width_percent * (map->stroke_um[1] - map->stroke_um[0]) * pow(all_v / own_v, 3.0);
}

/* What the drives of all files span. */
static double whole_span(const look_t *looks, size_t count) {
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (size_t i = 0; i < count; i++) {
        low = fmin(low, looks[i].drive.range_v[0]);
        high = fmax(high, looks[i].drive.range_v[1]);
    }
    return high - low;
}

static void find(const look_t *looks, size_t count, const fault_kind_t *kind, fault_list_t *faults) {
    const double all_v = whole_span(looks, count);
    for (size_t i = 1; i < count; i++) {
        const static_map_t *first = &looks[0].map, *other = &looks[i].map;
        double difference[STATIC_LEVELS];
        size_t levels = 0;
        for (size_t l = 0; l < other->levels; l++) {
            double a, b;
            if (middle_at(first, other->level_v[l], &a) && middle_at(other, other->level_v[l], &b)) {
                difference[levels++] = b - a;
            }
        }
        if ((double)levels < threshold.levels_shared) {
            continue;
        }
        const double offset = look_quantile(difference, levels, 0.5);
        const double scatter = fmax(look_robust_deviation(difference, levels),
                                    fmax(looks[0].prediction.noise_um, looks[i].prediction.noise_um));
        const double beyond = fabs(offset) - fmax(width_of(&looks[0], all_v), width_of(&looks[i], all_v));
        fault_t *fault =
            beyond > 0.0 ? fault_add(faults, kind, i, beyond / scatter, look_log_chance_normal(beyond / scatter, 1.0))
                         : NULL;
        if (fault != NULL) {
            fault_number(fault, "offset_um", "um", offset, scatter / sqrt((double)levels));
        }
    }
}

const fault_kind_t fault_file_offset = {
    .name = "file_offset",
    .order = 40,
    .text = "This file has another zero than the first one, by more than the past of a hysteresis can make.",
    .statistic = "distance of the middles of the loops beyond the wider loop, over its scatter",
    .change =
        "Record in one session, or set the sensor to zero at the same drive after the same motion; take the offset "
        "off.",
    .handling = FAULT_MODELLABLE,
    .find = find};
