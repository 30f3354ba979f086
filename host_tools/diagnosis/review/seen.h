/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * What a look has shown and the answer does not explain.
 *
 * After a step it rings, and no block of the chain rings with that frequency (probe_t.rings). Then what the chain
 * leaves behind those steps is tested: cos and sin of the ring, decaying as the look saw it, beside a parabola. Where
 * they are there with a chance below that of a ring (threshold.false_ring), more than noise is left, whatever its part
 * of all samples: the verdict cannot be that nothing is missing, or that all is explained.
 */
#ifndef SEEN_H
#define SEEN_H

#include "diagnosis/answer/state.h"

bool seen_compare(state_t *state);

#endif
