/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "look/signal/reversals.h"
#include "base/failure.h"
#include <stdlib.h>
#include <string.h>

void reversals_find(const double *value, size_t samples, double least, reversals_t *turns) {
    size_t high = 0, low = 0, room = 0;
    int way = 0; /* 1: it rises, and an extreme would be a maximum */
    memset(turns, 0, sizeof *turns);
    for (size_t k = 1; k < samples; k++) {
        size_t found = samples;
        high = value[k] > value[high] ? k : high;
        low = value[k] < value[low] ? k : low;
        if (way >= 0 && value[high] - value[k] > least) {
            found = high;
            way = -1;
            low = k;
        } else if (way <= 0 && value[k] - value[low] > least) {
            found = low;
            way = 1;
            high = k;
        }
        if (found < samples && found > 0) {
            if (turns->count == room) {
                room = 2 * room + 64;
                turns->at = reallocate(turns->at, room, sizeof *turns->at);
            }
            turns->at[turns->count++] = found;
        }
    }
}

void reversals_free(reversals_t *turns) {
    free(turns->at);
    memset(turns, 0, sizeof *turns);
}
