/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Independent tasks on all processors.
 *
 * Each task writes to separate memory, so that results do not depend on the number of processors. The caller's thread
 * works too. A task may call parallel() again: whichever thread becomes idle takes of the tasks that no thread has
 * begun, the oldest call's first. A thread that waits for a call's last tasks takes only of those that they have made,
 * so that it is there when they have returned. The threads stay, as many as processors but one, and take no signals.
 */
#ifndef PARALLEL_H
#define PARALLEL_H

#include <stddef.h>

typedef void parallel_task_t(void *context, size_t index);

/** Calls task(context, index) for every index < count, in no particular order, and returns when all have returned. */
void parallel(size_t count, parallel_task_t *task, void *context);

/** Number of parts into which a sum over many rows is split. It depends only on the work, so that results are the same
 * on any number of processors; 1 if there is too little work for threads. */
size_t parallel_parts(double multiplications);
/** The first row of a part; with part = parts, behind the last one. */
static inline size_t parallel_part(size_t rows, size_t part, size_t parts) {
    return rows * part / parts;
}

/** Limits the number of threads from now on; 0, the default: as many as the environment variable HYST_THREADS says, or
 * as processors. Not while tasks run. */
void parallel_limit(size_t threads);

#endif
