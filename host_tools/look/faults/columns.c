/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Columns that are not what their names say: swapped, inverted, or in another unit. */
#include "look/fault.h"
#include "look/swapped.h"
#include "thresholds/thresholds.h"
#include <gsl/gsl_math.h>

static void find_swapped(const look_t *looks, size_t count, const fault_kind_t *kind, fault_list_t *faults) {
    for (size_t i = 0; i < count; i++) {
        const look_t *look = &looks[i];
        swapped_t swapped;
        swapped_look(look->recording, &look->drive, &look->map, &look->prediction, &swapped);
        fault_t *fault = swapped.suspected ? fault_add(faults, kind, i, swapped.turned, swapped.log_chance) : NULL;
        if (fault != NULL) {
            fault_number(fault, "levels", "1", swapped.levels, 0.0);
            fault_number(fault, "noise_of_drive_v", "V", swapped.noise_v, HUGE_VAL);
        }
    }
}

static void find_inverted(const look_t *looks, size_t count, const fault_kind_t *kind, fault_list_t *faults) {
    for (size_t i = 0; i < count; i++) {
        const response_t *response = &looks[i].response;
        size_t seen = 0, turned = 0;
        double least_z = HUGE_VAL, lowest_hz = 0.0;
        for (size_t p = 0; p < response->count && (double)seen < threshold.lowest_points; p++) {
            const response_point_t *point = &response->point[p];
            if (point->coherence >= threshold.coherent) {
                lowest_hz = seen == 0 ? point->frequency_hz : lowest_hz;
                seen++;
                turned += M_PI - fabs(point->phase_rad) < threshold.half_turn_within ? 1 : 0;
                least_z = fmin(least_z, 0.5 * M_PI / fmax(point->phase_sigma, 1e-9));
            }
        }
        /* One tone may be above a mode, where the sign turns; not so low. */
        const bool enough =
            (double)seen >= threshold.lowest_points || (seen > 0 && lowest_hz < threshold.tone_below_hz);
        if (!enough || turned < seen || !(looks[i].map.gain_um_per_v < 0.0)) {
            continue;
        }
        fault_t *fault = fault_add(faults, kind, i, least_z, look_log_chance_normal(least_z, 1.0));
        if (fault != NULL) {
            fault_number(fault, "gain_um_per_v", "um/V", looks[i].map.gain_um_per_v, HUGE_VAL);
            fault_number(fault, "at_hz", "Hz", lowest_hz, 0.0);
        }
    }
}

static void find_scale(const look_t *looks, size_t count, const fault_kind_t *kind, fault_list_t *faults) {
    for (size_t i = 0; i < count; i++) {
        const drive_look_t *d = &looks[i].drive;
        const static_map_t *map = &looks[i].map;
        const double range_v = d->range_v[1] - d->range_v[0], stroke = map->stroke_um[1] - map->stroke_um[0];
        if (d->kind == DRIVE_RESTS || !(range_v > 0.0) || !(stroke > 0.0)) {
            continue;
        }
        const double by_gain = (log10(stroke / range_v) - threshold.gain_log) / threshold.gain_log_deviation;
        const double by_drive = fmax(0.0, (log10(range_v) - threshold.drive_log) / threshold.drive_log_deviation);
        const double z = fmax(fabs(by_gain), by_drive);
        fault_t *fault = fault_add(faults, kind, i, z, look_log_chance_normal(z, 1.0));
        if (fault != NULL) {
            fault_number(fault, "gain_um_per_v", "um/V", stroke / range_v, HUGE_VAL);
            fault_number(fault, "drive_range_v", "V", range_v, HUGE_VAL);
            fault_number(fault, "stroke_um", "um", stroke, HUGE_VAL);
        }
    }
}

const fault_kind_t fault_swapped_columns = {
    .name = "swapped_columns",
    .order = 10,
    .text = "Drive and displacement look swapped: the displacement is exact and leads, the drive has noise and lags.",
    .statistic = "levels of the drive at which the loop turns the wrong way",
    .change = "Exchange them: hyst import FILE --drive .. --displacement .. says which column is what.",
    .handling = FAULT_FATAL,
    .alone = true,
    .find = find_swapped};

const fault_kind_t fault_inverted_column = {
    .name = "inverted_column",
    .order = 20,
    .text = "The position falls where the drive rises, at the lowest frequencies too: a column has the wrong sign.",
    .statistic = "distance of the phase from a quarter turn at the lowest frequencies, in standard errors",
    .change = "Turn the sign of one column; a sensor that looks at the actuator from the other side counts backwards.",
    .handling = FAULT_FATAL,
    .find = find_inverted};

const fault_kind_t fault_scale_error = {
    .name = "scale_error",
    .order = 30,
    .text = "Micrometres per volt, or volts, are far from those of any piezo actuator: a column is in another unit.",
    .statistic = "distance of the logarithm from that of piezo actuators (gain 0.3 nm/V .. 10 um/V, 10 .. 1000 V: two "
                 "deviations each), in deviations",
    .change = "Check the units: mV for V, nm or mm for um, an amplifier's gain left out.",
    .handling = FAULT_FATAL,
    .find = find_scale};
