/* SPDX-License-Identifier: GPL-3.0-or-later */
/** One round of an attempt: the chain gets one more block, or none. */
#ifndef SEARCH_ROUND_H
#define SEARCH_ROUND_H

#include "diagnosis/answer/state.h"

/**
 * Asks the three questions (evidence.h) one after another, the last only where enough is left. It ends when the best
 * candidate of a search (search.h) convinces (candidate_judgement.h), and the held-out samples support it, fitted
 * together with all else that was found. That is a finding then, and in the diagnosis' model. Writes into the diagnosis
 * what was considered, and what the blocks that were looked for in vain would have had to be like.
 */
bool search_round(state_t *state, bool *found_one);

#endif
