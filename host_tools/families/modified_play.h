/* SPDX-License-Identifier: GPL-3.0-or-later */
/** The estimate of paper 001 itself, beside the families that `hyst fit` offers. */
#ifndef FAMILY_MODIFIED_PLAY_H
#define FAMILY_MODIFIED_PLAY_H

#include "family.h"

/** Recursive least squares: weights of any sign, and a recursion that may run away when it is simulated. */
extern const family_t family_one_step_modified_play;

#endif
