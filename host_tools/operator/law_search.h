/* SPDX-License-Identifier: GPL-3.0-or-later */
/** The search for the Duhem law of the universal operator. */
#ifndef OPERATOR_LAW_SEARCH_H
#define OPERATOR_LAW_SEARCH_H

#include "operator/equations.h"

/** Leaves the operator with the likeliest law where that is worth it, beside the noise that it has; otherwise without
 * one. Of every `thin`-th used sample. The evidence is that of the last fit. */
bool law_search(const operator_question_t *question, size_t thin, hysteresis_t *hysteresis, failure_t *failure);

#endif
