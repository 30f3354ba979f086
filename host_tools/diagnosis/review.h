/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Findings that stand beside one shape of hysteresis are tested again beside all of them (belief/shape.h).
 */
#ifndef REVIEW_H
#define REVIEW_H

#include "diagnosis/attempt.h"

/** Before the search: the operator in the place of the chain's hysteresis. Fills job->beside and diagnosis->shape. */
void review_begin(attempt_t *job, const model_t *chain);
/** Frees what review_begin has kept; also where it was not called. */
void review_close(attempt_t *job);
/**
 * After it. Where the operator explains everything and no block says anything beside it, what was found is taken out,
 * unless it explains with its one or two numbers what the operator needs many for. Where the
 * operator explains what the findings leave, that is the shape of the hysteresis and nothing is missing any more.
 */
bool review_end(attempt_t *job);

/** What the models deliver as they would be written. Where nothing was found and no model was given, a straight line or
 * a bank of plays takes the model's place if it leaves less of the held-out samples. */
bool review_delivered(attempt_t *job);

#endif
