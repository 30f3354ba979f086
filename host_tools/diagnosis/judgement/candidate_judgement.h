/* SPDX-License-Identifier: GPL-3.0-or-later */
/** What makes a candidate a finding: significant, large enough where it acts, and not contradicted. */
#ifndef CANDIDATE_JUDGEMENT_H
#define CANDIDATE_JUDGEMENT_H

#include "diagnosis/answer/state.h"
#include "diagnosis/evidence/candidate.h"

/** By the measured voltage or current, as surely as it takes to make a name. */
bool candidate_contradicted(const candidate_t *candidate);

/** The first of the candidates, of which there is one at least. That the held-out samples support it is tested
 * elsewhere (search_round.h). */
bool candidate_convinces(const state_t *state, const evidence_t *evidence, const candidates_t *found);

#endif
