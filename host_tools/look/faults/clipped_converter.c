/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Readings that stop at an end while the drive goes on. An amplifier's rail is something else: behind it there is
 * noise. In readings without noise the drive decides: behind a rail the position leaves the end at the drive at which
 * it got there; hysteresis keeps it beyond a converter's end for longer. */
#include "look/fault.h"
#include "look/runs.h"
#include "thresholds/thresholds.h"
#include <math.h>
#include <stdlib.h>

typedef struct {
    size_t samples, runs, longest;
    double log_chance, way_v;
    double later_v; /* how much further back the drive has gone when the position leaves the end, least of all runs */
} end_t;

/* What stands at one end of the readings. */
static void look_at_end(const look_t *look, const equal_run_t *runs, size_t count, size_t end, end_t *seen) {
    const double *y = look->recording->column[COLUMN_DISPLACEMENT], *u = look->recording->column[COLUMN_DRIVE];
    const double sign = (end == 1 ? 1.0 : -1.0) * (look->map.gain_um_per_v < 0.0 ? -1.0 : 1.0);
    *seen = (end_t){.later_v = HUGE_VAL};
    for (size_t i = 0; i < count; i++) {
        const look_span_t span = runs[i].span;
        if (y[span.from] == look->map.stroke_um[end]) {
            double range[2];
            values_range(u + span.from, span_length(span), range);
            seen->samples += span_length(span);
            seen->runs++;
            seen->longest = span_length(span) > seen->longest ? span_length(span) : seen->longest;
            seen->log_chance = fmin(seen->log_chance, runs[i].log_chance);
            seen->way_v = fmax(seen->way_v, range[1] - range[0]);
            if (span.from > 0 && span.to < look->recording->samples) {
                seen->later_v = fmin(seen->later_v, sign * (u[span.from] - u[span.to - 1]));
            }
        }
    }
}

/* The farthest that the drive goes while a reading without noise that is at no end stays: a coarse one keeps each of
 * its values for a while. */
static double way_elsewhere(const look_t *look, const equal_run_t *runs, size_t count) {
    const double *y = look->recording->column[COLUMN_DISPLACEMENT], *u = look->recording->column[COLUMN_DRIVE];
    double way_v = 0.0;
    for (size_t i = 0; i < count && look->prediction.noise_um <= threshold.noise_of_runs * look->noise.step_um; i++) {
        const look_span_t span = runs[i].span;
        if (y[span.from] != look->map.stroke_um[0] && y[span.from] != look->map.stroke_um[1]) {
            double range[2];
            values_range(u + span.from, span_length(span), range);
            way_v = fmax(way_v, range[1] - range[0]);
        }
    }
    return way_v;
}

static void find_in(const look_t *look, size_t index, const fault_kind_t *kind, fault_list_t *faults) {
    const double *y = look->recording->column[COLUMN_DISPLACEMENT];
    const double range_v = look->drive.range_v[1] - look->drive.range_v[0];
    static const char *const names[] = {"low_um", "high_um"};
    size_t count;
    equal_run_t *runs = equal_runs(look, &count);
    const double elsewhere_v = threshold.way_beside_others * way_elsewhere(look, runs, count);
    for (size_t end = 0; end < 2; end++) {
        end_t seen;
        double log_chance = 0.0;
        look_at_end(look, runs, count, end, &seen);
        if ((double)seen.samples < threshold.least_at_end ||
            seen.way_v < threshold.way_at_end * range_v + elsewhere_v) {
            continue;
        }
        if (seen.log_chance < look_log_chance_limit()) {
            log_chance = seen.log_chance;
        } else if (seen.runs >= 2 && isfinite(seen.later_v) && seen.later_v > threshold.leaves_end_later * range_v) {
            /* Each run leaves later than it came; by chance one in two would. Readings without noise: the drive's way
             * while nothing was read is no chance at all, so all of its samples count. */
            log_chance = -(double)seen.samples * log10(2.0);
        }
        fault_t *fault = fault_add(faults, kind, index, (double)seen.longest, log_chance);
        if (fault != NULL) {
            fault_number(fault, names[end], "um", look->map.stroke_um[end], 0.0);
            fault_number(fault, "samples", "1", (double)seen.samples, 0.0);
            for (size_t i = 0; i < count; i++) {
                if (y[runs[i].span.from] == look->map.stroke_um[end]) {
                    fault_span(fault, runs[i].span.from, runs[i].span.to);
                }
            }
        }
    }
    free(runs);
}

static void find(const look_t *looks, size_t count, const fault_kind_t *kind, fault_list_t *faults) {
    for (size_t i = 0; i < count; i++) {
        find_in(&looks[i], i, kind, faults);
    }
}

const fault_kind_t fault_clipped_converter = {
    .name = "clipped_converter",
    .order = 80,
    .text = "Readings stop at one value, without noise, while the drive goes on: the end of the sensor's converter.",
    .statistic = "samples of the longest run of equal readings at the end of the range",
    .change = "Choose a larger input range of the sensor, or move its zero so that the whole stroke fits. Leave these "
              "samples out.",
    .handling = FAULT_MASKABLE,
    .find = find};
