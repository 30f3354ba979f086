/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Progress bar on stderr. Draws only when stderr is a terminal, at most ten times a second; otherwise every call is
 * free.
 */
#ifndef PROGRESS_H
#define PROGRESS_H

#include <stdbool.h>

typedef struct {
    const char *what; /**< "fitting"; must outlive the bar */
    bool terminal;
    double drawn_s; /**< monotonic time of the last drawing */
} progress_t;

void progress_begin(progress_t *progress, const char *what);

/** fraction: 0 to 1 of the whole work. */
void progress_update(progress_t *progress, double fraction);

/** Removes the bar. */
void progress_end(progress_t *progress);

#endif
