/* SPDX-License-Identifier: GPL-3.0-or-later */
/** The stages of a diagnosis, in their order. docs/DIAGNOSIS.md prints this table. */
#ifndef STAGES_H
#define STAGES_H

#include <stdbool.h>
#include <stddef.h>

/** All that the stages hand on; diagnose.c. */
typedef struct diagnosing diagnosing_t;

typedef struct {
    const char *name;
    const char *does;
    const char *face;               /**< the header to read */
    bool (*run)(diagnosing_t *all); /**< false: the diagnosis fails, with the failure that it was given */
} stage_t;

extern const stage_t diagnosis_stages[];
extern const size_t diagnosis_stage_count;

#endif
