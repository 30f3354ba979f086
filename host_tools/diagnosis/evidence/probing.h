/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * The best probe of a block: where its refinement begins (candidate.h).
 *
 * Each block lists some instances of itself (probe.h). All of them are simulated and tested. The best is the one that
 * promises most for the refinement; where the effect is proportional to a searched number its size does not matter,
 * because the refinement begins with the amplitude that the test has found.
 */
#ifndef PROBING_H
#define PROBING_H

#include "diagnosis/evidence/candidate.h"

/** Of each block that the problem asks about and that can be simulated there, in the catalogue's order. */
void probe_blocks(const search_problem_t *problem, candidates_t *probed);
/** This one, whatever the question. false: it cannot be simulated there; otherwise to be freed. */
bool probe_block(const search_problem_t *problem, const block_t *block, candidate_t *best);

#endif
