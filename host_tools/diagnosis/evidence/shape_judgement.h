/* SPDX-License-Identifier: GPL-3.0-or-later */
/** How well a shape of hysteresis suits recordings in which something else may be missing too. */
#ifndef SHAPE_JUDGEMENT_H
#define SHAPE_JUDGEMENT_H

#include "diagnosis/evidence/joint_fit.h"

/**
 * What is left when offsets, the derivatives by the numbers of the model's hysteresis and these signatures (columns:
 * what blocks that may be missing would change) are fitted to the samples that are not held out. Numbers that these
 * hardly see stay near where they are (hysteresis_numbers.h). HUGE_VAL: it cannot be simulated. past: and what an
 * unknown past may have left (nuisance.h), too. Where the shape is not linear in its numbers, they go where they stand
 * best beside the signatures, by a few steps of Gauss and Newton's method, and the model takes them.
 */
joint_power_t shape_judgement(const samples_t *samples, const noise_t *noise, model_t *model, double **signature,
                              size_t signatures, bool past);

#endif
