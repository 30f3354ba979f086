/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Findings that stand beside one shape of hysteresis are tested again beside all of them (belief/shape.h).
 */
#ifndef REVIEW_H
#define REVIEW_H

#include "diagnosis/answer/state.h"

/**
 * After the search. Where the operator explains everything and no block says anything beside it, what was found is
 * taken out, unless it explains with its one or two numbers what the operator needs many for. Where the operator
 * explains what the findings leave, that is the shape of the hysteresis and nothing is missing any more.
 */
bool review_end(state_t *state);

/** What the models deliver as they would be written. Where that is clearly more than what is reported, another past may
 * be what lacks (past_choice.h). If no model was given, a straight line or a bank of plays takes the baseline's place
 * if it delivers less, and is not clearly worse where the samples count; and the model's, where nothing was found. */
bool review_delivered(state_t *state);

#endif
