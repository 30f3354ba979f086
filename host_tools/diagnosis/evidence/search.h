/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Looking for one missing block: every candidate of the catalogue against the evidence.
 *
 * All blocks are probed (probing.h). Those that explain most are refined, the best of these fitted together with the
 * hysteresis, and with them what the best one could be confused with.
 *
 * They are ordered by merit, those that were fitted first: 2 log likelihood, by position, voltage and current, less the
 * price of the searched numbers.
 */
#ifndef SEARCH_H
#define SEARCH_H

#include "diagnosis/evidence/candidate.h"

/** Tries the candidates that the evidence's question is about. Best first. */
void search(const search_problem_t *problem, candidates_t *found);
/** The best probe of each block, and no more. Best first. */
void search_probes(const search_problem_t *problem, candidates_t *found);

/** By how much the first candidate's 2 log likelihood exceeds that of another one. HUGE_VAL: the hysteresis could not
 * be fitted together with the other one, which it could be confused with. */
double search_margin(const candidates_t *found, size_t other);

#endif
