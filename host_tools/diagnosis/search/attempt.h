/* SPDX-License-Identifier: GPL-3.0-or-later */
/** One attempt of a diagnosis: the whole search from one chain on. */
#ifndef ATTEMPT_H
#define ATTEMPT_H

#include "diagnosis/answer/state.h"
#include "diagnosis/search/heard.h"

/** Where a search may begin in the place of the chain itself. */
typedef struct {
    const model_t *model;
    const block_t *const *block; /**< of its blocks those that a fit has found together (contest.h) */
    size_t blocks;
} begin_t;

/**
 * 1. Fits the chain's hysteresis, and what else of it the recordings determine (refitted.h).
 * 2. From there, or from `begin` in its place (NULL: not), finds block after block (search_round.h). What was found
 *    together is put in first, if the held-out samples miss it.
 * 3. Settles which of them stay (reconsider.h), their names (names.h) and their sides (sides.h).
 * 4. Judges what remains (verdict.h).
 *
 * Fills the state, which has just begun (state_begin).
 */
bool attempt_from(state_t *state, const model_t *given, const begin_t *begin);

/** The same with findings that are not looked for: what was heard, with the numbers that it has beside the universal
 * operator. Only the hysteresis is fitted to them. */
bool attempt_with(state_t *state, const model_t *given, const heard_t *heard);

#endif
