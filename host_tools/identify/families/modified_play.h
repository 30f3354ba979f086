/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Estimates of paper 001 that the amplifier cannot invert as a rule, beside the families that `hyst fit` offers. */
#ifndef FAMILY_MODIFIED_PLAY_H
#define FAMILY_MODIFIED_PLAY_H

#include "identify/family.h"

/** Fitted as simulations, with weights of any sign as in the paper. */
extern const family_t family_free_modified_play, family_free_truncated_modified_play, family_free_bouc_wen;

/** The paper's recursive least squares; its recursion may diverge in simulation. */
extern const family_t family_one_step_modified_play;

#endif
