/* SPDX-License-Identifier: GPL-3.0-or-later */
/** What these recordings would have shown of the blocks that were not found; and of those of which they could not show
 * any, why. */
#ifndef UNSEEN_H
#define UNSEEN_H

#include "diagnosis/answer/state.h"
#include "diagnosis/evidence/candidate.h"

/** Of the blocks that were tried in vain in a round. */
void unseen_note(answer_t *answer, const candidates_t *found);

/**
 * When the search is over: of every other block of the catalogue that is looked for and is neither in the chain nor
 * what a finding can be confused with. Those that the last round did not ask for (it was found, and others made it
 * superfluous) are probed in the chain as it is; converter steps are a matter of the readings.
 */
bool unseen_complete(state_t *state);

/**
 * Where the model leaves another shape of hysteresis, what it would have shown is no matter of the noise alone: that
 * shape may be the block. A block is then seen from where it speaks beside the universal operator, in the operator's
 * noise. A curve, and what the operator imitates altogether, is not testable.
 */
void unseen_beside_operator(state_t *state);

#endif
