/* SPDX-License-Identifier: GPL-3.0-or-later */
/** One round of an attempt: the chain gets one more block, or none. */
#ifndef SEARCH_ROUND_H
#define SEARCH_ROUND_H

#include "diagnosis/attempt.h"

/**
 * Asks the three questions (evidence.h) one after another, the last only where enough is left, until the best candidate
 * of a search (search.h) convinces (candidate_judgement.h), and the held-out samples support it when it is fitted
 * together with all else that was found. Then it is a finding, and in the diagnosis' model. Writes into the diagnosis
 * what was considered, and what the blocks that were looked for in vain would have had to be like.
 */
bool search_round(attempt_t *job, bool *found_one);

#endif
