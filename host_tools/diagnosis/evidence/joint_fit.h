/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Fits the numbers of a model's hysteresis together with the searched parameters (probe.h) of some of its blocks, by
 * Gauss and Newton's method. This is least squares of the whitened residual over the samples that are not held out,
 * beyond what an unknown past left in them (past.h).
 */
#ifndef JOINT_FIT_H
#define JOINT_FIT_H

#include "diagnosis/noise/noise.h"

typedef struct {
    double fitted; /**< sum of squares of the whitened residual over the samples that were fitted */
    double held;   /**< and over the ones that are held out */
} joint_power_t;

/** Bits for joint_fit of these blocks, as far as a model has them. */
unsigned joint_blocks(const model_t *model, const block_t *const *block, size_t count);

/**
 * Which blocks: bits, 1 << index in the model. At most `iterations`. Numbers that the samples say nothing about stay
 * where they are. False only if the model cannot be simulated where it starts.
 */
bool joint_fit(const samples_t *samples, const noise_t *noise, model_t *model, unsigned blocks, size_t iterations,
               joint_power_t *power, failure_t *failure);

/**
 * A held drive that is late is late by whole samples, unless something behind it takes its time. The delay becomes the
 * middle of those that are the same, over *same_s. Returns its block's index; the number of blocks: there is none.
 */
size_t joint_middle_of_same(const samples_t *samples, const noise_t *noise, model_t *model, double *same_s);

/**
 * Standard errors of these blocks' searched parameters, and of the hysteresis' single numbers, written into the model:
 * as joint_fit determines them, widened by the autocorrelation of the whitened residual (autocorrelation.h). 0 at a
 * bound, HUGE_VAL where it is larger than the number (of one searched by its logarithm) or than half its range.
 */
bool joint_errors(const samples_t *samples, const noise_t *noise, model_t *model, unsigned blocks, failure_t *failure);

/** What a model leaves as it is. */
bool joint_power(const samples_t *samples, const noise_t *noise, const model_t *model, joint_power_t *power,
                 failure_t *failure);

#endif
