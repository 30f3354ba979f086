/* SPDX-License-Identifier: GPL-3.0-or-later */
/** An actuator from a formula: play operators whose density falls exponentially with the threshold. */
#ifndef TESTS_SYNTHETIC_H
#define TESTS_SYNTHETIC_H

#include "chain/model.h"
#include "hyst/parameters.h"

#define SYNTHETIC_RATE_HZ 10000.0

/**
 * The density, cut into `operators` pieces: 0..100 V, about 1 um/V, of which a third is hysteresis. `gain` scales the
 * whole. Few operators are a coarse picture of the same actuator.
 */
void synthetic_model(model_t *model, size_t operators, double gain);

/** What the amplifier is given: compiled from few operators. */
hyst_parameters_t synthetic_parameters(size_t operators, double gain);

#endif
