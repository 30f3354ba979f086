/* SPDX-License-Identifier: GPL-3.0-or-later */
/** The stages of a diagnosis, in their order. docs/DIAGNOSIS.md prints this table. */
#ifndef STAGES_H
#define STAGES_H

#include "base/failure.h"
#include <stddef.h>

struct question; /* question.h */
struct state;    /* state.h: it knows the question, and cannot change it */
struct shapes;   /* diagnose.c: the chains that a search begins with */

/** A stage makes the question, or works at the answer. false: the diagnosis fails, and the failure says why. */
typedef struct {
    const char *name;
    const char *does;
    const char *face; /**< the header to read */
    bool (*ask)(struct question *question, struct shapes *shapes, failure_t *failure);
    bool (*search)(struct state *state, struct shapes *shapes);
} stage_t;

extern const stage_t diagnosis_stages[];
extern const size_t diagnosis_stage_count;

#endif
