/* SPDX-License-Identifier: MIT */
/** The whole sample interrupt's work, loop_sample, measured on a board that has nothing but a counter. */
#ifndef COST_LOOP_H
#define COST_LOOP_H

#include "hyst/parameters.h"

typedef enum { COST_SINE, COST_STEPS } cost_source_t;

typedef struct {
    uint32_t worst;
    uint64_t sum;
    uint32_t calls;
} cost_t;

/** Instructions since some point in time, and what looking twice costs with nothing in between. */
uint32_t cost_counter(void);
uint32_t cost_of_looking(void);
void cost_add(cost_t *cost, uint32_t taken);

/**
 * Commits the parameters through the registers, as a master would, while whatever the call before left is still
 * playing: that sample's cost goes to `adopting`. Then plays the source in compensate mode while the capture runs.
 * COST_STEPS goes to another one of the 128 `steps` in every sample. After amplifier_init.
 */
void cost_measure_loop(cost_t *playing, cost_t *adopting, const hyst_parameters_t *parameters, cost_source_t source,
                       const hyst_q31_t steps[128]);

#endif
