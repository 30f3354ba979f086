/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/noise/held_out.h"
#include "numerics/reversals.h"
#include "thresholds/thresholds.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { USUALLY = 2, CELLS = 24, ALL_CELLS = CELLS * CELLS };

/* Samples of each cell in each block. A cell is where the drive is on its loops: its level, and that of its last turn.
 * A path that is gone again has the same cells again, whenever that is. */
typedef struct {
    unsigned in[ALL_CELLS][HELD_OUT_BLOCKS];
} cells_t;

static held_out_t the_same_of_each(size_t of_three) {
    held_out_t order;
    memset(order.of_three, (int)of_three, HELD_OUT_GROUPS);
    return order;
}

held_out_t held_out_usually(void) {
    return the_same_of_each(USUALLY);
}

static size_t block_of(size_t samples, size_t sample) {
    return sample * HELD_OUT_BLOCKS / samples;
}

static bool block_is_held_out(const held_out_t *order, size_t block) {
    return order->of_three[block / HELD_OUT_EVERY] == block % HELD_OUT_EVERY;
}

bool is_held_out(const held_out_t *order, size_t samples, size_t sample) {
    return block_is_held_out(order, block_of(samples, sample));
}

static void cells_count(const recording_t *recording, size_t from, cells_t *cells) {
    const double *drive = recording->column[COLUMN_DRIVE] + from;
    const size_t samples = recording->samples - from;
    double range[2];
    reversals_t turns;
    values_range(drive, samples, range);
    reversals_find_by_part(drive, samples, 1.0 / CELLS, &turns);
    const double scale = range[1] > range[0] ? (CELLS - 1e-9) / (range[1] - range[0]) : 0.0;
    size_t turned = 0;
    for (size_t k = 0; k < samples; k++) {
        turned += turned < turns.count && turns.at[turned] <= k ? 1 : 0;
        const double turn_v = drive[turned > 0 ? turns.at[turned - 1] : 0];
        const size_t level = (size_t)((drive[k] - range[0]) * scale), turn = (size_t)((turn_v - range[0]) * scale);
        cells->in[turn * CELLS + level][block_of(recording->samples, from + k)]++;
    }
    reversals_free(&turns);
}

static void share_of_cell(const cells_t *cells, size_t cell, const held_out_t *order, double *held, double *all) {
    *held = *all = 0.0;
    for (size_t block = 0; block < HELD_OUT_BLOCKS; block++) {
        *held += block_is_held_out(order, block) ? (double)cells->in[cell][block] : 0.0;
        *all += (double)cells->in[cell][block];
    }
}

/* Of the samples that are held out, the part that is in cells of which no fit sees any. */
static double unseen(const cells_t *cells, const held_out_t *order) {
    double all_held = 0.0, alone = 0.0;
    for (size_t i = 0; i < ALL_CELLS; i++) {
        double held, all;
        share_of_cell(cells, i, order, &held, &all);
        all_held += held;
        alone += held == all ? held : 0.0;
    }
    return all_held > 0.0 ? alone / all_held : 0.0;
}

/* How unevenly cells fall to both parts: 0 if a third of each is held out. */
static double unevenness(const cells_t *cells, const held_out_t *order) {
    double sum = 0.0;
    for (size_t i = 0; i < ALL_CELLS; i++) {
        double held, all;
        share_of_cell(cells, i, order, &held, &all);
        sum += all > 0.0 ? pow(held - all / HELD_OUT_EVERY, 2.0) / all : 0.0;
    }
    return sum;
}

/* The order in which both parts share all paths as evenly as can be: one group of three after another is changed while
 * that helps. */
static void order_by_paths(const cells_t *cells, held_out_t *order) {
    double least = unevenness(cells, order);
    for (bool better = true; better;) {
        better = false;
        for (size_t i = 0; i < HELD_OUT_BLOCKS; i++) {
            held_out_t other = *order;
            other.of_three[i / HELD_OUT_EVERY] = (unsigned char)(i % HELD_OUT_EVERY);
            const double sum = unevenness(cells, &other);
            if (sum < least) {
                least = sum;
                *order = other;
                better = true;
            }
        }
    }
}

bool drive_near_end(double drive_v, size_t end, const double range[2]) {
    return fabs(drive_v - range[end]) <= threshold.rails_show * (range[1] - range[0]);
}

/* How evenly the samples near one end of the range (0: the low one) fall to both parts: 1, or less. */
static double evenness(const recording_t *recording, size_t from, const held_out_t *order, size_t end,
                       const double range[2]) {
    const double *drive = recording->column[COLUMN_DRIVE];
    double held = 0.0, all = 0.0;
    for (size_t k = from; k < recording->samples; k++) {
        if (drive_near_end(drive[k], end, range)) {
            held += is_held_out(order, recording->samples, k) ? 1.0 : 0.0;
            all += 1.0;
        }
    }
    const double share = 1.0 / HELD_OUT_EVERY, part = all > 0.0 ? held / all : share;
    return fmin(part / share, (1.0 - part) / (1.0 - share));
}

/* What happens only near an end of the drive's range can be found only where both parts have samples there. */
static held_out_t order_by_ends(const recording_t *recording, size_t from) {
    double range[2], most = 0.0;
    held_out_t best = held_out_usually();
    values_range(recording->column[COLUMN_DRIVE] + from, recording->samples - from, range);
    for (size_t i = 0; i < HELD_OUT_EVERY && most < threshold.least_share_at_rails; i++) {
        const held_out_t order = the_same_of_each((USUALLY + i) % HELD_OUT_EVERY);
        const double even =
            fmin(evenness(recording, from, &order, 0, range), evenness(recording, from, &order, 1, range));
        if (even > most) {
            most = even;
            best = order;
        }
    }
    return best;
}

held_out_t held_out_choose(const recording_t *recording, size_t from) {
    held_out_t order = held_out_usually();
    cells_t *cells = allocate(1, sizeof *cells);
    cells_count(recording, from, cells);
    if (unseen(cells, &order) > threshold.most_unseen_paths) {
        order_by_paths(cells, &order);
    } else {
        order = order_by_ends(recording, from);
    }
    free(cells);
    return order;
}
