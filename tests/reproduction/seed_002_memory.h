/* SPDX-License-Identifier: GPL-3.0-or-later */
/** The two properties that characterise a Preisach model, tried out on the twin of paper 002 and on a model of it. */
#ifndef SEED_002_MEMORY_H
#define SEED_002_MEMORY_H

#include "chain/model.h"
#include "reproduction.h"

/** Reports how well the twin, its ceramic alone and this model (of 0 to 70 V) wipe out, and how congruent their loops
 * are. */
bool describe_memory_002(reproduction_t *reproduction, const model_t *model, failure_t *failure);

#endif
