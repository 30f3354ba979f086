/* SPDX-License-Identifier: MIT */
/**
 * On and off: what has to be true before the output may move, and what takes it back.
 *
 *   off         parked, stage disabled, nothing moves
 *     | arm
 *   precharge   stage enabled, output at the parking drive: time for the stage to come up, and self test
 *     | after POWER_PRECHARGE_MS, when nothing fails; a fault, if it still does after POWER_SELF_TEST_MS
 *   on          modes, sources and conditioning are possible
 *     | disarm
 *   stopping    ramp to the parking drive, then off
 *
 *   fault       from any state: ramp to the parking drive, then the stage is disabled. Only the command stop leads out
 * of it, to stopping and so to off; arming comes after that. Nothing re-enables itself.
 *
 * The stage is switched only while the output rests at the parking drive: on when armed, off otherwise. Whatever comes
 * within a ramp, the stage stays as it was: what was on is never cut, and what was off does not come on. Only an
 * accepted arming ever leads from off to on.
 *
 * May be called from: the context that owns the power_state_t (the sample interrupt; the main loop under board_lock).
 */
#ifndef POWER_STATE_H
#define POWER_STATE_H

#include <stdbool.h>
#include <stdint.h>

#define POWER_PRECHARGE_MS 100U
/** From the beginning of precharge: a stage whose supply is not up by then has failed. */
#define POWER_SELF_TEST_MS 1000U

typedef enum { POWER_OFF, POWER_PRECHARGE, POWER_ON, POWER_STOPPING, POWER_FAULT } power_t;

typedef struct {
    power_t state;
    uint32_t precharge; /**< samples that are left of it */
    uint32_t patience;  /**< samples after it in which the self test may fail */
    uint32_t cause;     /**< FAULT_ bits of what tripped, 0 outside of fault */
    uint32_t trips;     /**< so many since the start, wraps */
    uint32_t last_trip; /**< what the newest one was: FAULT_ bits */
    bool stage;         /**< enabled */
} power_state_t;

/** Off. */
void power_init(power_state_t *power);

/** To precharge, for so many samples, and at most `patience` more. Nothing happens when it is armed already. False in a
 * fault. */
bool power_arm(power_state_t *power, uint32_t samples, uint32_t patience);

/** To stopping, unless off or in a fault. */
void power_disarm(power_state_t *power);

/** To fault. The first cause stays. */
void power_trip(power_state_t *power, uint32_t cause);

/** Out of a fault, if there is one. Returns whether there was. */
bool power_leave_fault(power_state_t *power);

/** Before each sample: is the output at the parking drive, and which faults does the self test find (FAULT_ bits; asked
 * in precharge alone)? Returns those that are to trip: precharge has waited for them long enough. */
uint32_t power_sample(power_state_t *power, bool parked, uint32_t failing);

/** Armed: precharge or on. */
static inline bool power_armed(const power_state_t *power) {
    return power->state == POWER_PRECHARGE || power->state == POWER_ON;
}

/** The stage's enable line: after power_sample and whatever tripped, once a sample. Stays: no other image, which may
 * park elsewhere, is about to be in force. It does not come on before. */
bool power_stage(power_state_t *power, bool parked, bool stays);

#endif
