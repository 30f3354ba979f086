/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "numerics/reversals.h"
#include "base/failure.h"
#include <gsl/gsl_statistics_double.h>
#include <stdlib.h>
#include <string.h>

static void note(reversals_t *turns, size_t at, size_t *room) {
    if (turns->count == *room) {
        *room = 2 * *room + 64;
        turns->at = reallocate(turns->at, *room, sizeof *turns->at);
    }
    turns->at[turns->count++] = at;
}

void reversals_find(const double *value, size_t samples, double least, reversals_t *turns) {
    size_t high = 0, low = 0, room = 0;
    int way = 0; /* 1: it rises, and an extreme would be a maximum; 0: it has not gone far enough yet */
    memset(turns, 0, sizeof *turns);
    for (size_t k = 1; k < samples; k++) {
        high = value[k] > value[high] ? k : high;
        low = value[k] < value[low] ? k : low;
        if (way == 0 && value[high] - value[low] > least) {
            way = high > low ? 1 : -1;
        } else if (way > 0 && value[high] - value[k] > least) {
            note(turns, high, &room);
            way = -1;
            low = k;
        } else if (way < 0 && value[k] - value[low] > least) {
            note(turns, low, &room);
            way = 1;
            high = k;
        }
    }
}

void reversals_find_by_part(const double *value, size_t samples, double part, reversals_t *turns) {
    double low, high;
    gsl_stats_minmax(&low, &high, value, 1, samples);
    reversals_find(value, samples, part * (high - low), turns);
}

size_t reversals_count_by_part(const double *value, size_t samples, double part) {
    reversals_t turns;
    reversals_find_by_part(value, samples, part, &turns);
    const size_t count = turns.count;
    reversals_free(&turns);
    return count;
}

void reversals_free(reversals_t *turns) {
    free(turns->at);
    memset(turns, 0, sizeof *turns);
}
