/* SPDX-License-Identifier: GPL-3.0-or-later */
/** The command line of a job, from what a page wants: {"do": "fit", "recordings": [..], ..} (docs/LIVE.md). */
#ifndef JOB_LINE_H
#define JOB_LINE_H

#include "serve/folder.h"
#include "serve/job.h"

/** Most files that a job makes. */
#define JOB_LINE_MADE 2

typedef struct {
    const char *argument[JOB_ARGUMENTS];   /**< of `hyst`, with the name of the command; ends with NULL */
    char made[JOB_LINE_MADE][FOLDER_NAME]; /**< names of the files that it makes if it succeeds; "": none */
    /* What it is made with. */
    const char *folder;
    double sample_rate_hz;                 /* of the amplifier; 0: unknown */
    char text[JOB_ARGUMENTS][FOLDER_PATH]; /* what the arguments point to, where they are no constants */
    size_t count;
} job_line_t;

/** Whether a page may want this: "fit", "diagnose", "compile", "look", "simulate", "report", "import". */
bool job_line_knows(const char *name);

/** To be freed. NULL on failure. folder must outlive it. */
job_line_t *job_line_read(const char *name, json_t *message, const char *folder, double sample_rate_hz,
                          failure_t *failure);

#endif
