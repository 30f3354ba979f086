/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/where/loop_parts.h"
#include "thresholds/thresholds.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

const double loop_still = 2e-5;
enum { SHORTEST_HOLD = 20 };

/* Samples at which the drive turns round, with the first and the last one. Returns how many; free *at. */
static size_t find_reversals(const double *drive, size_t samples, double way, size_t **at) {
    size_t count = 1, extreme = 0, low = 0, high = 0; /* until it has gone far enough in either direction */
    double direction = 0.0;
    *at = allocate(samples + 1, sizeof **at); /* the first is 0 */
    for (size_t k = 1; k < samples; k++) {
        const double from_extreme = drive[k] - drive[extreme];
        if (direction == 0.0) {
            low = drive[k] < drive[low] ? k : low;
            high = drive[k] > drive[high] ? k : high;
            direction = !(drive[high] - drive[low] > way) ? 0.0 : high > low ? 1.0 : -1.0;
            extreme = k;
        } else if (direction * from_extreme >= 0.0) {
            extreme = k;
        } else if (-direction * from_extreme > way) {
            (*at)[count++] = extreme;
            direction = -direction;
            extreme = k;
        }
    }
    (*at)[count++] = samples - 1;
    return count;
}

size_t loop_turns(const double *drive, size_t samples, double part, size_t **at) {
    double ends[2];
    values_range(drive, samples, ends);
    const size_t found = find_reversals(drive, samples, part * (ends[1] - ends[0]), at) - 2;
    memmove(*at, *at + 1, found * sizeof **at);
    return found;
}

size_t loop_reversals(const double *drive, size_t samples, double part) {
    size_t *at;
    const size_t found = loop_turns(drive, samples, part, &at);
    free(at);
    return found;
}

void loop_parts(const double *drive, size_t samples, loop_part_t *part) {
    double ends[2];
    values_range(drive, samples, ends);
    const double range = ends[1] - ends[0];
    size_t *reversal, reversals = find_reversals(drive, samples, threshold.turns_round * range, &reversal);
    for (size_t i = 0; i + 1 < reversals; i++) {
        const double begin = drive[reversal[i]], way = drive[reversal[i + 1]] - begin;
        for (size_t k = reversal[i]; k <= reversal[i + 1]; k++) {
            const double passed = way != 0.0 ? (drive[k] - begin) / way : 0.5;
            part[k] = passed < threshold.turning_part || passed > 1.0 - threshold.turning_part ? LOOP_TURNING_POINTS
                                                                                               : LOOP_MID_BRANCH;
        }
    }
    const double least = fmax(SHORTEST_HOLD, threshold.hold_part * (double)samples / (double)(reversals - 1));
    for (size_t first = 0, next; first < samples; first = next) {
        double low = drive[first], high = drive[first];
        for (next = first + 1; next < samples; next++) {
            low = fmin(low, drive[next]);
            high = fmax(high, drive[next]);
            if (high - low > loop_still * range) {
                break;
            }
        }
        for (size_t k = first; (double)(next - first) >= least && k < next; k++) {
            part[k] = LOOP_HOLDS;
        }
    }
    free(reversal);
}

loop_part_t find_loop_part(const recording_t *recordings, size_t count, double *const *difference, const size_t *from,
                           double floor_um) {
    double sum[LOOP_HOLDS + 1] = {0}, samples[LOOP_HOLDS + 1] = {0}, all = 0.0;
    for (size_t i = 0; i < count; i++) {
        const size_t length = recordings[i].samples - from[i];
        loop_part_t *part = allocate(length, sizeof *part);
        loop_parts(recordings[i].column[COLUMN_DRIVE] + from[i], length, part);
        for (size_t k = 0; k < length; k++) {
            sum[part[k]] += difference[i][from[i] + k] * difference[i][from[i] + k];
            samples[part[k]] += 1.0;
        }
        all += (double)length;
        free(part);
    }
    for (size_t p = 0; p <= LOOP_HOLDS; p++) {
        sum[p] = samples[p] > threshold.least_part_of_loop * all ? fmax(0.0, sum[p] / samples[p] - floor_um * floor_um)
                                                                 : 0.0;
    }
    for (loop_part_t p = LOOP_TURNING_POINTS; p <= LOOP_HOLDS; p++) {
        bool alone = true;
        for (loop_part_t other = LOOP_TURNING_POINTS; other <= LOOP_HOLDS; other++) {
            alone = alone && (other == p || sum[p] > threshold.part_stands_out * sum[other]);
        }
        if (alone) {
            return p;
        }
    }
    return LOOP_EVERYWHERE;
}
