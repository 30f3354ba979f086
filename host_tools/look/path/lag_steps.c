/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "look/path/lag_steps.h"
#include <stdlib.h>
#include <string.h>

enum { LAGS = 2 * PROBLEM_EDGE + 1 };

static double left_with(const problem_t *p, const double *expected, size_t window, int lag) {
    double sum = 0.0;
    for (size_t k = p->from[window]; k < p->from[window + 1]; k++) {
        const double left = p->y[(long)k - lag] - expected[k];
        sum += left * left;
    }
    return sum;
}

/* Of the windows before: the cheapest way to be at this lag now. Returns its price; from: the lag it comes from. */
static double cheapest(const double *before, int lag, double price, int *from) {
    double least = before[lag];
    *from = lag;
    for (int step = -CHANGES_MOST_SHIFT; step <= CHANGES_MOST_SHIFT; step++) {
        const int other = lag - step;
        if (other >= 0 && other < LAGS && before[other] + price < least) {
            least = before[other] + price;
            *from = other;
        }
    }
    return least;
}

void lag_steps(const problem_t *p, const double *expected, double price, int *lag) {
    double before[LAGS] = {0.0}, now[LAGS];
    int *from = allocate(p->windows * LAGS, sizeof *from);
    for (size_t w = 0; w < p->windows; w++) {
        for (int i = 0; i < LAGS; i++) {
            now[i] = left_with(p, expected, w, i - PROBLEM_EDGE) +
                     (w > 0 ? cheapest(before, i, price, &from[w * LAGS + (size_t)i]) : 0.0);
        }
        memcpy(before, now, sizeof before);
    }
    int best = 0;
    for (int i = 1; i < LAGS; i++) {
        best = before[i] < before[best] ? i : best;
    }
    for (size_t w = p->windows; w-- > 0;) {
        lag[w] = best - PROBLEM_EDGE;
        best = from[w * LAGS + (size_t)best];
    }
    free(from);
}
