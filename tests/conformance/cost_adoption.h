/* SPDX-License-Identifier: MIT */
/** The samples that adopt new parameters after the histories that make it dear. */
#ifndef COST_ADOPTION_H
#define COST_ADOPTION_H

#include "cost_loop.h"

/** What is measured: from one hysteresis to another, with every filter, creep cell and curve there can be, half of the
 * time new ones. */
extern const unsigned cost_adoptions;
const char *cost_adoption_name(unsigned index);

/**
 * Fills the memory as deep as it goes, in direct mode, then adopts in compensate mode, with ever smaller reversals in
 * every sample, or jumps across the range. The samples that adopt go to *cost. Returns how many an adoption took at
 * most. `parameters` is only room for them.
 */
uint32_t cost_measure_adoption(cost_t *cost, generator_t *generator, hyst_parameters_t *parameters, unsigned index);

#endif
