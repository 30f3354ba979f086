/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Independent tasks on all processors.
 *
 * Each task writes to a place of its own, so that what comes out does not depend on how many processors there are. The
 * caller's thread takes part; further threads are started as long as processors are idle. A task may call parallel()
 * again: it gets the processors that are idle then, and otherwise does its tasks one after another.
 */
#ifndef PARALLEL_H
#define PARALLEL_H

#include <stddef.h>

typedef void parallel_task_t(void *context, size_t index);

/** Calls task(context, index) for every index < count, in no particular order, and returns when all have returned. */
void parallel(size_t count, parallel_task_t *task, void *context);

/** In how many parts sums over many rows are made at once, so that they are the same on any number of processors: one
 * where there is so little to multiply that other threads would start when all is done. */
size_t parallel_parts(double multiplications);
/** The first row of a part; with part = parts, behind the last one. */
static inline size_t parallel_part(size_t rows, size_t part, size_t parts) {
    return rows * part / parts;
}

/** At most so many threads at a time from here on; 0, as in the beginning: as many as there are processors. Not while
 * tasks run. */
void parallel_limit(size_t threads);

#endif
