/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Where a signal turns round. */
#ifndef REVERSALS_H
#define REVERSALS_H

#include <stddef.h>

typedef struct {
    size_t count;
    size_t *at; /**< samples of the extremes, in order; the first and the last sample are not among them */
} reversals_t;

/** Extremes between ways of more than `least`. To be freed. */
void reversals_find(const double *value, size_t samples, double least, reversals_t *turns);
/** The same between ways of more than this part of the signal's range. */
void reversals_find_by_part(const double *value, size_t samples, double part, reversals_t *turns);
/** How many these are. */
size_t reversals_count_by_part(const double *value, size_t samples, double part);
void reversals_free(reversals_t *turns);

#endif
