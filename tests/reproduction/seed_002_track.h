/* SPDX-License-Identifier: GPL-3.0-or-later */
/** The actuator of paper 002 behind the amplifier. */
#ifndef SEED_002_TRACK_H
#define SEED_002_TRACK_H

#include "amplifier.h"
#include "chain/model.h"

/**
 * Tracks a sine with the twin, through the image that the model compiles to, at the model's sample rate. Error in % of
 * the sine's range. The amplifier drives 0 to 75 V.
 */
bool track_002(const model_t *model, hyst_mode_t mode, double hz, double middle_um, double range_um, uint64_t seed,
               tracking_error_t *error, failure_t *failure);

#endif
