/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Progress of long work, and the request to end it. One listener per process may be registered; without one all calls
 * cost nothing.
 *
 * Long work ends early when that is requested. The functions that everything long consists of (a simulation, a fit's
 * equations, a projection) test the request: they then fail, or do nothing and leave zeros. So all loops above them run
 * dry within a fraction of a second, and their results are worthless: fit_recordings, the two diagnoses and looks_at,
 * which begin long work, end with progress_go_on.
 */
#ifndef PROGRESS_H
#define PROGRESS_H

#include "base/failure.h"

/** One piece of work, from progress_begin to progress_end. {0}: not reported. */
typedef struct {
    const char *what; /**< "fitting"; must outlive the work */
    double fraction;  /**< that was last reported */
} progress_t;

/** Callbacks for progress. They run in the thread that does the work; those of nested pieces are nested. */
typedef struct {
    void (*begin)(void *context, const char *what);
    void (*update)(void *context, const char *what, double fraction); /**< 0 to 1 of the whole work */
    void (*end)(void *context, const char *what);
    void *context;
} progress_listener_t;

/** The listener must outlive all work. NULL, the default: none. Not while work is going on. */
void progress_listen(const progress_listener_t *listener);

void progress_begin(progress_t *progress, const char *what);

/** fraction of the whole work, limited to 0 to 1. */
void progress_update(progress_t *progress, double fraction);

/** What is done from now on, at the same fraction: reported at once. It must outlive the work, too. */
void progress_name(progress_t *progress, const char *what);

void progress_end(progress_t *progress);

/** Requests that all work of the process ends; false: takes that back, before other work. From any thread or signal
 * handler. */
void progress_cancel(bool cancel);
/** Whether that is requested. Costs as much as reading a variable. */
bool progress_cancelled(void);
/** true; or false with the line "interrupted". */
bool progress_go_on(failure_t *failure);

#endif
