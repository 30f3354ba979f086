/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/where/drive_rate.h"
#include "diagnosis/where/cells.h"
#include "diagnosis/where/loop_parts.h"
#include "thresholds/thresholds.h"
#include <math.h>
#include <stdlib.h>

enum { RATE_CELLS = 24, CELLS = 1 + RATE_CELLS /* the first one is that of the holds */ };
static const double slowest_part = 1e-4;

/* The rate of the motion that led to a hold, over its beginning; then none. */
static void rest(const double *drive, size_t samples, double sample_rate_hz, const loop_part_t *part, double *rate) {
    double ends[2], last = 0.0;
    size_t begun = 0;
    values_range(drive, samples, ends);
    for (size_t k = 0; k < samples; k++) {
        const double step = k > 0 ? fabs(drive[k] - drive[k - 1]) : 0.0;
        if (part[k] != LOOP_HOLDS) {
            last = rate[k];
            begun = k + 1;
        } else if (step > loop_still * (ends[1] - ends[0])) {
            last = step * sample_rate_hz;
            begun = k;
        }
        rate[k] = part[k] != LOOP_HOLDS || (double)(k - begun) < threshold.hold_part_s * sample_rate_hz ? last : 0.0;
    }
}

void drive_rates(const double *drive, size_t samples, double sample_rate_hz, double *rate) {
    loop_part_t *part = allocate(samples, sizeof *part);
    for (size_t first = 0, next; first < samples; first = next) {
        for (next = first + 1; next < samples && drive[next] == drive[first]; next++) {
        }
        const double step = first > 0 ? fabs(drive[first] - drive[first - 1]) : 0.0;
        for (size_t k = first; k < next; k++) {
            rate[k] = step * sample_rate_hz / (double)(next - first);
        }
    }
    loop_parts(drive, samples, part);
    rest(drive, samples, sample_rate_hz, part, rate);
    free(part);
}

/* Of those that are none: in the first cell. */
static size_t cell_of(double rate, double slowest, double width) {
    const double at = rate > slowest ? log(rate / slowest) / width : 0.0;
    const size_t cell = at < RATE_CELLS ? (size_t)at : RATE_CELLS - 1;
    return rate > 0.0 ? 1 + cell : 0;
}

/* Rates of the included samples; the slowest motion and the fastest. */
static double **find_rates(const recording_t *recordings, size_t count, const size_t *from, double range[2]) {
    double **rate = recordings_room(recordings, count);
    range[0] = HUGE_VAL;
    range[1] = 0.0;
    for (size_t i = 0; i < count; i++) {
        const recording_t *r = &recordings[i];
        drive_rates(r->column[COLUMN_DRIVE] + from[i], r->samples - from[i], r->sample_rate_hz, rate[i] + from[i]);
        for (size_t k = from[i]; k < r->samples; k++) {
            range[0] = rate[i][k] > 0.0 ? fmin(range[0], rate[i][k]) : range[0];
            range[1] = fmax(range[1], rate[i][k]);
        }
    }
    range[0] = fmin(range[1], fmax(range[0], slowest_part * range[1]));
    return rate;
}

void locate_in_rate(const recording_t *recordings, size_t count, double *const *difference, const size_t *from,
                    double floor_um, ranges_t *ranges) {
    cell_t cell[CELLS] = {{0}};
    double range[2];
    double **rate = find_rates(recordings, count, from, range);
    const double width = fmax(log(range[1] / range[0]) / RATE_CELLS, 1e-9);
    for (size_t i = 0; i < count; i++) {
        for (size_t k = from[i]; k < recordings[i].samples; k++) {
            cell_t *here = &cell[cell_of(rate[i][k], range[0], width)];
            here->visits += 1.0;
            here->energy += difference[i][k] * difference[i][k];
        }
    }
    for (size_t c = 1; c < CELLS; c++) {
        cell[c].from = range[0] * exp(width * (double)(c - 1));
        cell[c].to = c + 1 < CELLS ? range[0] * exp(width * (double)c) : range[1];
    }
    if (cells_have_no_place(cell, CELLS, floor_um)) {
        *ranges = (ranges_t){.count = 1, .range = {{cell[0].visits > 0.0 ? 0.0 : range[0], range[1]}}};
    } else {
        cells_collect(cell, CELLS, cells_octave_gap, 1.5 * width, ranges);
    }
    ranges_note_whole(ranges, cell[0].visits > 0.0 ? 0.0 : range[0], range[1]);
    recordings_room_free(rate, count);
}
