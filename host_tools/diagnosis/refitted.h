/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * The numbers of a given chain's blocks, beside its hysteresis. A delay or a mode that was right on another day is
 * fitted again with every block that is tried, so that its error is not taken for missing physics.
 */
#ifndef REFITTED_H
#define REFITTED_H

#include "diagnosis/diagnose.h"

/** Chooses those that the recordings determine: at least one number of the block (finding_determined). The others stay
 * as they were given; so do all where the recordings cannot tell them from each other. */
void refitted_choose(diagnosis_t *diagnosis, const model_t *given);
/** Whether a number of such a block has changed by more than two of its standard errors. */
bool refitted_changed(const model_block_t *given, const model_block_t *fitted, size_t parameter);
/** Where they are in a model, as bits. */
unsigned refitted_blocks(const diagnosis_t *diagnosis, const model_t *model);

#endif
