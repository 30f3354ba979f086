/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Every number that `hyst look` and `hyst diagnose` decide by, in one table: thresholds.def, where each has its reason
 * and what becomes worse on either side of it. docs/THRESHOLDS.md is made from it.
 */
#ifndef THRESHOLDS_H
#define THRESHOLDS_H

#include <stddef.h>

typedef struct {
#define TOPIC(topic)
#define THRESHOLD(name, moved, value, unit, why, lower, higher) double name;
#include "thresholds/thresholds.def"
#undef THRESHOLD
#undef TOPIC
} thresholds_t;

extern const thresholds_t threshold;

/** What a fifth of a threshold is: of the number, of what it is short of 1, of what it exceeds 1 by. */
typedef enum { WHOLE, BELOW_ONE, ABOVE_ONE } threshold_moved_t;

/** A row of the table; of a topic's headline only `topic`. */
typedef struct {
    const char *topic; /**< NULL: a threshold */
    const char *name;
    threshold_moved_t moved;
    double value;
    const char *unit, *why, *lower, *higher;
} threshold_row_t;

extern const threshold_row_t threshold_rows[];
extern const size_t threshold_row_count;

#endif
