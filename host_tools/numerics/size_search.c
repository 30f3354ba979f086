/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "numerics/size_search.h"
#include "base/parallel.h"
#include <stddef.h>

enum { MOST_DOUBLINGS = 4, STEPS = 4 };

/* Two sizes that are tried at once: each task writes its own result. */
typedef struct {
    size_cost_t *cost;
    void *context;
    double size[2], costs[2];
} two_sizes_t;

static void try_size(void *context, size_t index) {
    two_sizes_t *two = context;
    two->costs[index] = two->cost(two->context, two->size[index]);
}

static void try_two(two_sizes_t *two, double one, double other) {
    two->size[0] = one;
    two->size[1] = other;
    parallel(2, try_size, two);
}

double size_search(size_cost_t *cost, void *context, double first, double *least) {
    two_sizes_t two = {.cost = cost, .context = context};
    try_two(&two, first, 2.0 * first);
    double best = first, low = 0.5 * first, high = 2.0 * first;
    *least = two.costs[0];
    for (size_t i = 0; i < MOST_DOUBLINGS; i++) {
        const double next = i == 0 ? two.costs[1] : cost(context, 2.0 * best);
        high = 2.0 * best;
        if (!(next < *least)) {
            break;
        }
        low = best;
        best = high;
        *least = next;
    }
    for (size_t i = 0; i < STEPS; i++) {
        const double one = 0.5 * (low + best), other = 0.5 * (best + high);
        try_two(&two, one, other);
        if (two.costs[0] < *least && two.costs[0] <= two.costs[1]) {
            high = best;
            best = one;
            *least = two.costs[0];
        } else if (two.costs[1] < *least) {
            low = best;
            best = other;
            *least = two.costs[1];
        } else {
            low = one;
            high = other;
        }
    }
    return best;
}
