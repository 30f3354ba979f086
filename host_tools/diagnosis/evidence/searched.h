/* SPDX-License-Identifier: GPL-3.0-or-later */
/** The searched parameters of a block (probe.h), at an index in the model, as unknowns without bounds: their logarithms
 * where they are positive.
 */
#ifndef SEARCHED_H
#define SEARCHED_H

#include "chain/model.h"

typedef struct {
    size_t count;
    parameter_t *parameter[BLOCK_MAX_PARAMETERS]; /**< in the model */
    double *number[BLOCK_MAX_PARAMETERS];         /**< its value */
    double low[BLOCK_MAX_PARAMETERS], high[BLOCK_MAX_PARAMETERS];
    bool logarithmic[BLOCK_MAX_PARAMETERS];
    double scale[BLOCK_MAX_PARAMETERS]; /**< of one that is searched as it is */
    double kept[BLOCK_MAX_PARAMETERS];
    double held_s; /**< a change below this may be none: a delay of a drive that is held so long; 0 elsewhere */
} searched_t;

/** Whether a parameter of a block that diagnose looks for is searched. */
static inline bool is_searched(const block_t *block, size_t parameter) {
    return (block_search(block)->searched >> parameter & 1U) != 0;
}
/** Whether a number of a model's block is searched: one that joins (probe.h), once it differs from its default or, of
 * an array, is there. */
bool number_is_searched(const model_block_t *block, size_t parameter);
/** The least value at which a parameter of the block is searched. */
double searched_low(const block_t *block, size_t parameter);

/** held_s: how long the drive is held, 0 where it is not (recording_held_s). */
void searched_open(searched_t *searched, model_t *model, size_t at, double held_s);
/** A copy of the model (to be freed) in which one of them is changed a little, for a difference. Returns by how much,
 * in its unknown's unit. `model` and `at` are those of searched_open. */
double searched_nudge(const searched_t *searched, size_t i, const model_t *model, size_t at, model_t *nudged);
/** What the number changes by for a small change of its unknown, in parts of that. */
double searched_unit(const searched_t *searched, size_t i);
/** Takes a part of a step, not further than a factor of e and within the block's bounds. */
void searched_move(searched_t *searched, const double *step, double part);
/** Back to before the last move. */
void searched_back(searched_t *searched);
/** The step of Gauss and Newton's method, slightly damped; n small. */
void searched_solve(size_t n, const double *gram, const double *moment, double *step);

#endif
