/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Two blocks weighed against one that does nearly what they do together (`together` in probe.h).
 *
 * A search is for one block at a time. Where two are missing that a third is nearly equal to, the third explains more
 * than either of them, and would be taken.
 */
#ifndef BLOCK_PAIR_H
#define BLOCK_PAIR_H

#include "diagnosis/evidence/candidate.h"

/**
 * Which candidate a search is to begin with: 0, the best one, or the first of the two blocks where these, fitted
 * together, explain more than it by three times the price of a number; the other one then follows. They are weighed
 * only when the best one and the first of the two have been fitted, and the chain does not have the second one.
 */
size_t block_pair_first(const search_problem_t *problem, const candidates_t *found);

#endif
