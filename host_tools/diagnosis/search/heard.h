/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * What speaks beside the universal operator, block after block.
 *
 * The loudest block is put into the chain with the numbers at which the position is likeliest; weights and noise are
 * fitted again, and all others are weighed anew. No hysteresis of few numbers has a part in it, so a wrong one spoils
 * nothing.
 */
#ifndef HEARD_H
#define HEARD_H

#include "diagnosis/answer/state.h"

enum { HEARD_MOST = 3 };

typedef struct {
    size_t count;
    suspect_t suspect[HEARD_MOST]; /**< the chain of each has all before it, with the standard errors of its numbers */
    double before_percent[HEARD_MOST], after_percent[HEARD_MOST]; /**< that the operator leaves of held-out samples */
    shape_t shape;                                                /**< the operator beside all of them */
} heard_t;

/** Asks beside a chain: state->beside. Curves do not speak: they are shape. To be freed. */
void heard_listen(const state_t *state, heard_t *heard);
void heard_free(heard_t *heard);

#endif
