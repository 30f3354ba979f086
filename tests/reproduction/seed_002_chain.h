/* SPDX-License-Identifier: GPL-3.0-or-later */
/** One set of numbers for all frequencies of paper 002, where the thesis has one a frequency. */
#ifndef SEED_002_CHAIN_H
#define SEED_002_CHAIN_H

#include "chain/model.h"
#include "reproduction.h"

/** Drive that the thesis judges at, and its mean error there, in % of the stroke. */
typedef struct {
    const char *name;
    double hz, top_v, paper_percent;
} chain_002_case_t;

/**
 * Fits amplifier, asymmetry, plays and creep together to 0 to 70 V at 0.1, 1, 10 and 100 Hz, and reports a row a case.
 * On success the caller frees *model.
 */
bool fit_chain_002(reproduction_t *reproduction, const chain_002_case_t *cases, size_t count, model_t *model,
                   failure_t *failure);

#endif
