/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/where/loop_parts.h"
#include "numerics/reversals.h"
#include "thresholds/thresholds.h"
#include <math.h>
#include <stdlib.h>

const double loop_still = 2e-5;
enum { SHORTEST_HOLD = 20 };

/* From one end of a branch to the other. */
static void mark_branch(const double *drive, size_t first, size_t last, loop_part_t *part) {
    const double begin = drive[first], way = drive[last] - begin;
    for (size_t k = first; k <= last; k++) {
        const double passed = way != 0.0 ? (drive[k] - begin) / way : 0.5;
        part[k] = passed < threshold.turning_part || passed > 1.0 - threshold.turning_part ? LOOP_TURNING_POINTS
                                                                                           : LOOP_MID_BRANCH;
    }
}

/* Where the drive stays for at least so many samples. */
static void mark_holds(const double *drive, size_t samples, double still, double least, loop_part_t *part) {
    for (size_t first = 0, next; first < samples; first = next) {
        double low = drive[first], high = drive[first];
        for (next = first + 1; next < samples; next++) {
            low = fmin(low, drive[next]);
            high = fmax(high, drive[next]);
            if (high - low > still) {
                break;
            }
        }
        for (size_t k = first; (double)(next - first) >= least && k < next; k++) {
            part[k] = LOOP_HOLDS;
        }
    }
}

void loop_parts(const double *drive, size_t samples, loop_part_t *part) {
    double ends[2];
    values_range(drive, samples, ends);
    reversals_t turns;
    reversals_find_by_part(drive, samples, threshold.turns_round, &turns);
    for (size_t i = 0; i <= turns.count; i++) {
        mark_branch(drive, i > 0 ? turns.at[i - 1] : 0, i < turns.count ? turns.at[i] : samples - 1, part);
    }
    const double least = fmax(SHORTEST_HOLD, threshold.hold_part * (double)samples / (double)(turns.count + 1));
    mark_holds(drive, samples, loop_still * (ends[1] - ends[0]), least, part);
    reversals_free(&turns);
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
