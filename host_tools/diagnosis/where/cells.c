/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/where/cells.h"
#include "thresholds/thresholds.h"
#include <math.h>
#include <stdlib.h>

static int by_energy(const void *one, const void *other) {
    const cell_t *a = *(const cell_t *const *)one, *b = *(const cell_t *const *)other;
    /* Ties in the order of the cells: the same on every C library. */
    return a->energy != b->energy ? (a->energy < b->energy ? 1 : -1) : (a > b) - (a < b);
}

size_t cells_choose(cell_t *cell, size_t count) {
    cell_t **sorted = allocate(count, sizeof(cell_t *));
    double total = 0.0, sum = 0.0;
    size_t chosen = 0;
    for (size_t i = 0; i < count; i++) {
        sorted[i] = &cell[i];
        total += cell[i].energy;
    }
    qsort(sorted, count, sizeof(cell_t *), by_energy);
    while (total > 0.0 && chosen < count && sum < threshold.most_of_it * total) {
        sorted[chosen]->chosen = true;
        sum += sorted[chosen++]->energy;
    }
    free(sorted);
    return chosen;
}

double cells_linear_gap(const range_t *left, const range_t *right) {
    return right->from - left->to;
}

double cells_octave_gap(const range_t *left, const range_t *right) {
    return left->to > 0.0 ? log(right->from / left->to) : HUGE_VAL;
}

/* Neighbours with at most `joined` between them become one, and further ones until there are at most `most`. Returns
 * how many are left. */
static size_t bridge(range_t *range, size_t length, double (*gap)(const range_t *, const range_t *), double joined,
                     size_t most) {
    while (length > 1) {
        size_t narrowest = 0;
        for (size_t i = 1; i + 1 < length; i++) {
            narrowest = gap(&range[i], &range[i + 1]) < gap(&range[narrowest], &range[narrowest + 1]) ? i : narrowest;
        }
        if (length <= most && gap(&range[narrowest], &range[narrowest + 1]) > joined) {
            break;
        }
        range[narrowest].to = range[narrowest + 1].to;
        for (size_t i = narrowest + 1; i + 1 < length; i++) {
            range[i] = range[i + 1];
        }
        length--;
    }
    return length;
}

void cells_collect(const cell_t *cell, size_t count, double (*gap)(const range_t *, const range_t *), double joined,
                   ranges_t *ranges) {
    range_t *all = allocate(count, sizeof *all);
    size_t length = 0;
    for (size_t i = 0; i < count; i++) {
        if (cell[i].chosen) {
            all[length++] = (range_t){cell[i].from, cell[i].to};
        }
    }
    ranges->count = bridge(all, length, gap, joined, LOCATION_MOST_RANGES);
    for (size_t i = 0; i < ranges->count; i++) {
        ranges->range[i] = all[i];
    }
    free(all);
}

ranges_t ranges_bridged(const ranges_t *ranges, double (*gap)(const range_t *, const range_t *), size_t most) {
    ranges_t bridged = *ranges;
    bridged.count = bridge(bridged.range, ranges->count, gap, -HUGE_VAL, most);
    return bridged;
}

bool cells_have_no_place(cell_t *cell, size_t count, double floor_um) {
    double all = 0.0;
    size_t used = 0;
    for (size_t i = 0; i < count; i++) {
        all += cell[i].visits;
    }
    for (size_t i = 0; i < count; i++) {
        const bool visited = cell[i].visits > threshold.least_visited * all;
        used += visited ? 1 : 0;
        cell[i].energy = visited ? fmax(0.0, cell[i].energy / cell[i].visits - floor_um * floor_um) : 0.0;
    }
    return (double)cells_choose(cell, count) > threshold.no_place * (double)used;
}
