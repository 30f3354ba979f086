/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * A `hyst` command beside the server: fit, diagnose, compile. It is a separate process, so that it can be cancelled,
 * takes nothing from the line, and whatever happens to it leaves the server alone.
 */
#ifndef JOB_H
#define JOB_H

#include "base/failure.h"

/** Most arguments of a job, with the name of the command and the NULL at the end. */
#define JOB_ARGUMENTS 24

typedef struct job job_t;

typedef struct {
    /** A line that it printed; or how far it is ("fitting", 0 to 1). Called in the job's thread. */
    void (*line)(void *context, const char *line);
    void (*progress)(void *context, const char *what, double fraction);
    /** The last call. status: its exit status, or -1 if it was cancelled or ended by a signal. */
    void (*ended)(void *context, int status);
    void *context;
} job_listener_t;

/** One at a time. NULL on failure. */
job_t *job_start(const char *const argument[JOB_ARGUMENTS], const job_listener_t *listener, failure_t *failure);

/** Any thread. */
void job_cancel(job_t *job);

/** Waits until it has ended, and frees it. Not in its own thread. NULL is allowed. */
void job_end(job_t *job);

#endif
