/* SPDX-License-Identifier: GPL-3.0-or-later */
/** What an attempt comes to, when nothing more is found. */
#ifndef VERDICT_H
#define VERDICT_H

#include "diagnosis/answer/state.h"

/** Looks for structure in what the model leaves (remainder.h), and writes the remainder into the diagnosis. */
bool verdict_look(state_t *state);

/**
 * verdict_look, and the verdict.
 * missing: what the baseline left (attempt_excess). Blocks that leave too much of it, and structure, are not what is
 * missing but what comes nearest to it: they are detected, not named.
 */
bool verdict_reach(state_t *state, double missing);

#endif
