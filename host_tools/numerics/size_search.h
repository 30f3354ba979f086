/* SPDX-License-Identifier: GPL-3.0-or-later */
/** The size at which something costs least, where each cost takes seconds. */
#ifndef SIZE_SEARCH_H
#define SIZE_SEARCH_H

/** What a size costs; HUGE_VAL: it cannot be. Called by two threads at once. */
typedef double size_cost_t(void *context, double size);

/**
 * From a first size, above 0: twice as large as long as that costs less, four times at most. Then four times the better
 * one of the two sizes between the best and its neighbours, if it costs less than the best. The first two sizes, and
 * the two on both sides, are tried at once. least: what the returned size costs.
 */
double size_search(size_cost_t *cost, void *context, double first, double *least);

#endif
