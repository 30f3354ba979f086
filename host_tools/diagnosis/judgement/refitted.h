/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * The numbers of a given chain's blocks, beside its hysteresis. A delay or a mode that was right on another day is
 * fitted again with every block that is tried, so that its error is not taken for missing physics.
 */
#ifndef REFITTED_H
#define REFITTED_H

#include "diagnosis/answer/answer.h"

/** Chooses those that the recordings determine: at least one number of the block (finding_determined). The others stay
 * as they were given; so do all where the recordings cannot tell them from each other. */
void refitted_choose(answer_t *answer, const model_t *given);

#endif
