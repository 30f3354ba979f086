/* SPDX-License-Identifier: MIT */
/** The whole sample interrupt of the h405, measured (cost_board.c). */
#ifndef COST_LOOP_H
#define COST_LOOP_H

#include "cost_case.h"
#include "motion/source.h"

typedef enum { COST_SINE, COST_STEPS } cost_source_t;

/** The setpoint of a sample, counted from 0. */
typedef hyst_q31_t (*cost_setpoint_t)(uint32_t sample);

/** The board's clock, as if it ran. Before amplifier_init. */
void cost_board_init(void);

/** Lets the registers be written. After amplifier_init. */
void cost_unlock(void);

/**
 * Commits the parameters through the registers, as a master would, and runs the loop until it has adopted them: the
 * cost of these samples goes to `adopting`. Without `setpoint`, whatever the call before left goes on playing. Returns
 * how many samples it took. After amplifier_init.
 */
uint32_t cost_adopt(cost_t *adopting, const hyst_parameters_t *parameters, cost_setpoint_t setpoint);

/** So many samples of setpoints in a mode, at once where they lead. */
void cost_hold(hyst_mode_t mode, cost_setpoint_t setpoint, uint32_t samples);

/**
 * Adopts the parameters, then plays the source in compensate mode while the capture runs. The first sample of the mode,
 * in which the filters settle, counts among those that adopt. COST_STEPS goes to another
 * one of the 128 `steps` in every sample.
 */
void cost_measure_loop(cost_t *playing, cost_t *adopting, const hyst_parameters_t *parameters, cost_source_t source,
                       const hyst_q31_t steps[128]);

/** Plays this source in compensate mode with the parameters in force, while the capture takes these signals. */
void cost_measure_source(cost_t *playing, source_kind_t source, uint16_t signals);

#endif
