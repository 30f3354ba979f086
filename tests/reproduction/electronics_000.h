/* SPDX-License-Identifier: GPL-3.0-or-later */
/** What the recordings of paper 000 say about the amplifier: a lag and a limit of its rate, in front of plays. */
#ifndef ELECTRONICS_000_H
#define ELECTRONICS_000_H

#include "campaign_000.h"

/** Blocks amplifier_bandwidth, amplifier_slew_limit and prandtl_ishlinskii with ten plays, one set for the first `runs`
 * runs: two numbers searched, the rest linear. *model is the caller's to free even on failure. */
bool fit_electronics_and_plays(const campaign_t *campaign, size_t runs, model_t *model, failure_t *failure);

#endif
