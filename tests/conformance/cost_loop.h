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

/** The setpoint of a sample, counted from 0. */
typedef hyst_q31_t (*cost_setpoint_t)(uint32_t sample);

/**
 * Commits the parameters through the registers, as a master would, and runs the loop until it has adopted them: the
 * cost of these samples goes to `adopting`. Without `setpoint`, whatever the call before left goes on playing. Returns
 * how many samples it took. After amplifier_init.
 */
uint32_t cost_adopt(cost_t *adopting, const hyst_parameters_t *parameters, cost_setpoint_t setpoint);

/** So many samples of setpoints in a mode, at once where they lead. */
void cost_hold(hyst_mode_t mode, cost_setpoint_t setpoint, uint32_t samples);

/**
 * Adopts the parameters, then plays the source in compensate mode while the capture runs. COST_STEPS goes to another
 * one of the 128 `steps` in every sample.
 */
void cost_measure_loop(cost_t *playing, cost_t *adopting, const hyst_parameters_t *parameters, cost_source_t source,
                       const hyst_q31_t steps[128]);

#endif
