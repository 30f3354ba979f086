/* SPDX-License-Identifier: MIT */
/**
 * One sample's values, handed from the sample interrupt to the main loop as a whole.
 *
 * The names are those of the registers. Counters saturate, except the sequence number, which wraps.
 */
#ifndef TELEMETRY_H
#define TELEMETRY_H

#include "hyst/compensator.h"

/** Register `state`. */
typedef enum { LOOP_IDLE = 0, LOOP_PLAYING = 1, LOOP_CONDITIONING = 2, LOOP_PARKED = 3 } loop_state_t;

typedef struct {
    uint32_t sequence;
    loop_state_t state;
    hyst_mode_t active_mode;
    hyst_q31_t reference, drive, position; /**< aligned, see loop.h */
    uint32_t samples, drive_limited, unreachable, filter_saturated, overruns, converter_timeouts;
    uint32_t cost_last, cost_max; /**< of the samples before this one, whose own cost is not known yet */
    uint32_t fault_first;         /**< bit number + 1 */
    uint32_t faults_sticky, faults_live;
    uint32_t capture_state, capture_frames;
} telemetry_t;

/** Sample interrupt only. */
void telemetry_publish(const telemetry_t *sample);

/** Main loop only: the newest sample that was published. */
void telemetry_read(telemetry_t *sample);

#endif
