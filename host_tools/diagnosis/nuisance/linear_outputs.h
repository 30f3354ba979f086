/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * What a hysteresis puts out for each of its numbers in which it is linear: the weights of play operators (or functions
 * of them), and the functions of a Preisach table. The derivatives by all of them take one walk along the drive.
 */
#ifndef LINEAR_OUTPUTS_H
#define LINEAR_OUTPUTS_H

#include "diagnosis/nuisance/hysteresis_numbers.h"

typedef struct linear_outputs linear_outputs_t;

/** NULL where the hysteresis is linear in none of its numbers. Both must outlive it. */
linear_outputs_t *linear_outputs_open(const model_block_t *hysteresis, const hysteresis_numbers_t *numbers);
void linear_outputs_close(linear_outputs_t *linear);

/** Whether it says something of a number. */
bool linear_outputs_has(const linear_outputs_t *linear, size_t number);

/**
 * A recording from its beginning. signal: what the hysteresis gets: the settled one, then `samples` of them
 * (chain_run). column: [number], a value a sample, where it says something of it. False, and undefined, where relays
 * are led by a widened loop (signal_t.slack_v).
 */
bool linear_outputs_run(linear_outputs_t *linear, const signal_t *signal, size_t samples, double *const *column);

#endif
