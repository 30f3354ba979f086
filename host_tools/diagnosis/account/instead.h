/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Chains that a diagnosis has not: with another block in a finding's place, or with an effect that was not found. */
#ifndef INSTEAD_H
#define INSTEAD_H

#include "diagnosis/answer/answer.h"

/** The chain without the terms that are no effects (empirical.h). To be freed. */
void instead_of_terms(const answer_t *answer, model_t *model);

/** That chain with a rival in the finding's place, all of it fitted to the recordings. false: they have none of it, or
 * it cannot be simulated. To be freed. */
bool instead_of_finding(const answer_t *answer, const finding_t *finding, const block_t *rival, model_t *model);

/** A chain with an effect of `limits` times its detection limit, in the form that shows best. Returns the value of
 * unseen->parameter, which must be one of the block's. To be freed. */
double instead_of_nothing(const model_t *chain, const unseen_t *unseen, double limits, model_t *model);

#endif
