/* SPDX-License-Identifier: MIT */
/**
 * What a board allows a parameter image to ask for, beyond what makes sense by itself (parameters.h).
 *
 * An image is made by somebody who knows the actuator; these bounds belong to the amplifier: how fast its output may
 * travel, how long parking may take, how much a filter may amplify. The board states them and why
 * (firmware/app/board.h).
 *
 * May be called from: main loop, host. Not from the interrupt: a filter that rings for long takes 2^16 samples a
 * cascade.
 */
#ifndef HYST_BOARD_LIMITS_H
#define HYST_BOARD_LIMITS_H

#include "hyst/parameters.h"

typedef struct {
    /** Full scale per sample, 1 or more. A slower transition never arrives, a faster one is a step. */
    hyst_q31_t transition_slew_min, transition_slew_max;
    /** Most that a cascade of filters may amplify, 1 to HYST_FILTER_GAIN_MOST: see hyst_filter_gain_exceeds. 0: any,
     * for measurements of what filters cost. */
    uint32_t filter_gain_max;
} hyst_board_limits_t;

#define HYST_FILTER_GAIN_MOST 100U

/**
 * Is there an input within [-1, 1] that makes the cascade's output exceed `gain`? That is its peak gain, the sum of the
 * magnitudes of its impulse response: a bound on what any reference can do, not only a sine. Found by running the
 * cascade, with an impulse of 2^-7 and outputs in steps of 2^-31, so that small gains are exact to 10^-4. Poles too
 * near the unit circle for that (less than 2^-13 from it) count as exceeding, as does a response longer than 2^16
 * samples; the gains at rest and at half the sample rate are checked exactly besides.
 */
bool hyst_filter_gain_exceeds(const hyst_iir_t *filter, uint32_t gain);

/** HYST_PARAMETERS_OUT_OF_RANGE at transition_slew, shape, inertia or equalise, or OK. `compensator` is what
 * hyst_parameters_build made. */
hyst_parameters_fault_t hyst_board_limits_check(const hyst_board_limits_t *limits,
                                                const hyst_compensator_t *compensator);

#endif
