/* SPDX-License-Identifier: GPL-3.0-or-later */
/** What a candidate has to be to be told: significant, large enough where it acts, and not contradicted. */
#ifndef CANDIDATE_JUDGEMENT_H
#define CANDIDATE_JUDGEMENT_H

#include "attempt.h"
#include "search.h"

/** Root mean square of what J leaves of its signature, at its amplitude. */
double candidate_own_um(const candidate_t *candidate);

/** By the measured voltage or current, as surely as it takes to make a name. */
bool candidate_contradicted(const candidate_t *candidate);

/** The first of the candidates, of which there is one at least. That the held-out samples support it is not asked. */
bool candidate_convinces(const attempt_t *job, const evidence_t *evidence, const search_t *found);

#endif
