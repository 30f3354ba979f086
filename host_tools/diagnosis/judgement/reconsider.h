/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Taking findings out of an attempt's model again: each was the best when it was found, but what was found later may do
 * without it. The rest is fitted again.
 */
#ifndef RECONSIDER_H
#define RECONSIDER_H

#include "diagnosis/answer/state.h"

/** Takes out the findings, the latest first, that the others make superfluous: without them the fit is worse by less
 * than this size (root mean square, in parts of the noise), or the held-out samples do not miss them. One stays in any
 * case. spared: bits, those that stay, by index. */
bool reconsider_superfluous(state_t *state, double least_size, unsigned spared);

/** Standard errors; and takes out the findings, the latest first, of which no number differs significantly from none.
 */
bool reconsider_undetermined(state_t *state);

/** Takes a finding out. */
bool reconsider_take_out(state_t *state, size_t finding, outcome_t why);

#endif
