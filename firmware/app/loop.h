/* SPDX-License-Identifier: MIT */
/**
 * The loop: one call per sample, from the sample interrupt, and the few calls by which the main loop steers it.
 * docs/DESIGN.md, section 4.
 *
 * Alignment. A drive code computed in sample k shows in position sample k + latency (board_info). A reference that
 * enters the compensator in sample k is meant for the position that shows `lookahead` samples later still. So with
 * position sample k belong drive k - latency and reference k - latency - lookahead, and these are what telemetry and
 * capture report together, in every mode.
 *
 * Modes and sources. The requested mode is what the loop runs, except while conditioning, which drives directly.
 * Parking stops the source and conditioning. No change of mode, and no new parameters, step the drive
 * (hyst/compensator.h: transition). A source that starts elsewhere than where the reference is does step it: lead the
 * setpoint there first.
 *
 * After conditioning the drive is at drive_park and the loop goes on in the requested mode with the setpoint it had.
 * In linear and compensate mode the drive goes there as a transition; in direct mode the hold source starts from
 * drive_park and goes there with setpoint_slew.
 */
#ifndef LOOP_H
#define LOOP_H

#include "hyst/compensator.h"
#include "hyst/parameters.h"
#include "source.h"
#include "telemetry.h"

/** What the converters delivered. */
typedef struct {
    uint16_t position_code; /**< offset binary, board_info.position_bits wide, left-aligned to 16 bits */
    bool converter_timeout; /**< no fresh position; the code is the last one */
    bool overrun;           /**< more than one period passed since the last sample */
} loop_input_t;

/** What a parameter image becomes. */
typedef struct {
    hyst_compensator_t compensator;
    uint32_t lookahead_samples; /**< 0..HYST_LOOKAHEAD_MAX */
} loop_parameters_t;

/** Sample interrupt only. Returns the drive code: offset binary, rounded to board_info.drive_bits, left-aligned to 16
 * bits. */
uint16_t loop_sample(const loop_input_t *input);

/* Main loop only, from here on. */

/** Parked, demagnetised, counters zero. Before the sample interrupt is started. `faults` (FAULT_ bits) stay live for
 * ever. */
void loop_init(const loop_parameters_t *parameters, uint16_t faults);

/** Hands over parameters, which must not change from now on. The next sample adopts them, or up to HYST_PI_CARRY_CALLS
 * samples share carrying a deep memory over to them while the old ones go on (hyst_compensator_adopt). False (and
 * nothing happens) while earlier ones are still waiting. */
bool loop_adopt(const loop_parameters_t *next);
bool loop_adoption_pending(void);

/** Requested mode. Setting any mode ends the live watchdog fault. */
hyst_mode_t loop_mode(void);
void loop_set_mode(hyst_mode_t mode);

/** Parks and reports FAULT_WATCHDOG. */
void loop_park_by_watchdog(void);

/** The setpoint's slew after start-up: the whole range in 0.2 s at 10 kHz, as hyst_parameters_default's transition. */
#define LOOP_DEFAULT_SLEW (HYST_Q31_MAX / 1000)

/** Where the hold source goes, at most setpoint_slew (> 0) per sample. While a source plays the setpoint follows the
 * reference, so that stopping holds, and setting it has no effect. */
hyst_q31_t loop_setpoint(void);
void loop_set_setpoint(hyst_q31_t setpoint);
void loop_set_setpoint_slew(hyst_q31_t slew);

/** Starts a source (valid: source_settings_valid). Not while parked or conditioning. A sine locks the harmonics of a
 * modified play model (hyst_hysteresis_begin_sine). */
void loop_start(const source_settings_t *settings);
bool loop_playing_breakpoints(void);
bool loop_conditioning(void);

/** Stops the source and conditioning; the reference holds its last value. */
void loop_stop(void);

/** Sweeps the drive, from where it is, up to drive_high, down to drive_low and back to drive_park, at one converter
 * range per second. Then as said above. */
void loop_condition(void);

/** Counters to zero; sticky faults to those that are live. */
void loop_clear(void);

#endif
