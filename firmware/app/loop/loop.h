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
 * (hyst/compensator.h: transition); into new limits it ramps. A source that starts elsewhere than where the reference
 * is goes there with reference_limit_t.slew: lead the setpoint there first. Whatever jumps, no sample's drive is
 * farther from the last one's than register drive_slew (`slew_limited` counts the samples in which that was at
 * work).
 *
 * After conditioning the drive is at drive_park and the loop goes on in the requested mode with the setpoint it had.
 * In linear and compensate mode the drive goes there as a transition; in direct mode the hold source starts from
 * drive_park and goes there with setpoint_slew.
 */
#ifndef LOOP_H
#define LOOP_H

#include "board.h"
#include "hyst/compensator.h"
#include "hyst/parameters.h"
#include "loop/telemetry.h"
#include "motion/drive_range.h"
#include "motion/reference_limit.h"
#include "motion/source.h"
#include "protection/power_state.h"

/** What the converters delivered. */
typedef struct {
    uint16_t position_code; /**< offset binary, board_info.position_bits wide, left-aligned to 16 bits */
    uint32_t missed;        /**< periods without a sample since the last one; 0 without FAULT_OVERRUN */
    uint32_t faults;        /**< of this sample, any of
                                 FAULT_CONVERTER_TIMEOUT  no fresh position; the code is the last one
                                 FAULT_OVERRUN            more than one period since the last sample, or that ended late
                                 FAULT_SUPPLY             the supply is below what the converters need */
} loop_input_t;

/** What a parameter image becomes. */
typedef struct {
    drive_range_t range;            /**< the limits in force, within those of the image */
    uint32_t lookahead_samples;     /**< 0..HYST_LOOKAHEAD_MAX */
    hyst_compensator_t compensator; /**< each sample has a window in place of its limits */
    drive_range_t image_range;      /**< the limits of the image */
} loop_parameters_t;

/** Sample interrupt only. Returns the drive code: offset binary, rounded to board_info.drive_bits, left-aligned to 16
 * bits. */
uint16_t loop_sample(const loop_input_t *input);

/* Main loop only, from here on. */

/** Off (power_state.h), parked, demagnetised, counters zero. Before the sample interrupt is started. `faults` (FAULT_
 * bits) stay live without end, but for the supply's, which each sample has. */
void loop_init(loop_parameters_t *parameters, uint16_t faults);

/** Hands over parameters, which are the loop's from now on. The next sample adopts them, or up to HYST_PI_CARRY_CALLS
 * samples share carrying a deep memory over to them while the old ones go on (hyst_compensator_adopt). False (and
 * nothing happens) while earlier ones are still waiting. */
bool loop_adopt(loop_parameters_t *next);
bool loop_adoption_pending(void);

/** To precharge and on. `image_whole`: the image in force is what was committed (parameter_store_whole); trips in
 * precharge if not (FAULT_IMAGE). False in a fault. Disarming ramps to park, then off. */
bool loop_arm(bool image_whole);
void loop_disarm(void);
/** The image in force has changed in memory: trips (FAULT_IMAGE) while armed, and when it is armed later. */
void loop_image_damaged(void);
/** Armed: precharge or on. Ready: on. */
bool loop_armed(void);
bool loop_ready(void);
bool loop_in_fault(void);

/** Is it off, with the output at rest? */
bool loop_off(void);

/** The code of the parking drive. Sample interrupt, too. */
uint16_t loop_park_code(void);

/** Samples since loop_init, wrapping. */
uint32_t loop_samples(void);

/** Sample periods since loop_init, those without a sample included, wrapping: time. */
uint32_t loop_periods(void);

/** Requested mode; what the loop runs is park until it is ready. Other modes than park: only while armed. From park, a
 * mode begins with the reference at which it moves nothing (hyst_compensator_rest), as far as the reference's limits
 * have it; that is the setpoint, too, unless one was set since the output was last parked, disarmed or stopped. */
hyst_mode_t loop_mode(void);
void loop_set_mode(hyst_mode_t mode);

/** Each turn of the main loop: a mode that was taken on the way to park begins there, as the output does. */
void loop_settle(void);

/** A master has been heard; trips (FAULT_WATCHDOG) when that is longer ago than the timeout, outside of park. The
 * sample interrupt counts the time, in periods, missed ones included, so that a main loop that hangs trips too. 0 is
 * off. */
void loop_master_heard(void);
void loop_set_timeout(uint32_t milliseconds);
#define LOOP_DEFAULT_TIMEOUT_MS 1000U

/** From a trip on the sample interrupt feeds the hardware watchdog itself until the output rests, at most so long:
 * twice what a ramp takes (board_info.fault_slew_min). Then a main loop that stands still is the watchdog's. */
#define LOOP_FAULT_FEED_MS 1000U

/** The flash is being written, or no more. It stalls the sample interrupt, so late samples do not count meanwhile. Only
 * while loop_off(). */
void loop_set_storing(bool storing);

/** So many overruns in a row trip (FAULT_OVERLOAD), but for those of an adoption, which ends, and of storing. From then
 * on a plain ramp to park runs in place of the compensator, so that the main loop gets to hear the master again. */
#define LOOP_OVERRUNS_TO_TRIP 5U

/** The setpoint's slew after start-up: the whole range in 0.2 s at 10 kHz, as hyst_parameters_default's transition. */
#define LOOP_DEFAULT_SLEW (HYST_Q31_MAX / 1000)

/** Where the hold source goes, at most setpoint_slew (> 0) per sample. While a source plays the setpoint follows the
 * reference, so that stopping holds, and setting it has no effect. While parked it is what was set since, for the mode
 * to come, or else the parking drive. */
hyst_q31_t loop_setpoint(void);
void loop_set_setpoint(hyst_q31_t setpoint);
void loop_set_setpoint_slew(hyst_q31_t slew);

/** Starts a source (valid: source_settings_valid). Only when ready, and not while parked or conditioning. A sine locks
 * the harmonics of a modified play model (hyst_hysteresis_begin_sine). */
void loop_start(const source_settings_t *settings);
bool loop_plays(source_kind_t kind);
/** Tones of the multisine that plays; 0 where none does. */
uint32_t loop_tones(void);
bool loop_conditioning(void);

/** An output range within that of the image: of the one in force, and of one that is pending. False, and nothing
 * happens, unless low < high and the parking drives lie between them. */
bool loop_set_drive_limits(hyst_q31_t low, hyst_q31_t high);
bool loop_drive_limits_possible(hyst_q31_t low, hyst_q31_t high);

/** The largest step of the drive, 1 or more and at most the board's; a fault's ramp is no faster, either. */
void loop_set_drive_slew(hyst_q31_t slew);

/** Applies the same to an image that is to be adopted. False if its parking drive lies outside. */
bool loop_limit_range(loop_parameters_t *next);

/** Limits of the reference. */
void loop_set_reference_limit(const reference_limit_t *limit);

/** Limits on temperature and supplies, and looks in a row beyond them (health_watch.h). */
void loop_set_health_limits(const board_health_limits_t *limits, uint32_t looks);

/** Limit on the error of the model and how long above it warns (model_watch.h); 0 is none. */
void loop_set_model_limit(hyst_q31_t limit, uint32_t milliseconds);
#define LOOP_DEFAULT_MODEL_TIME_MS 500U

/** After a sample whose drive was not the model's, so long for what it left in the mechanics to decay: ten periods of
 * a mode of 1 kHz. */
#define LOOP_SETTLING_MS 10U

/** Limit on the average magnitude of the drive's steps, per sample; beyond it trips (FAULT_CURRENT). 0 is none. */
void loop_set_current_limit(hyst_q31_t limit);
hyst_q31_t loop_current_average(void);

/** How often it tripped since the start, and FAULT_ bits of the newest one, and the warnings that are live: for the
 * main loop's log. */
uint32_t loop_trips(uint32_t *cause);
uint32_t loop_warnings(void);

/** Stops the source and conditioning; the reference holds its last value, which is the setpoint then, also where it was
 * on its way to another. In a fault: leaves it, to off. */
void loop_stop(void);

/** Only while armed. Sweeps the drive, from where it is, up to drive_high, down to drive_low and back to drive_park, at
 * one converter range per second, or slower: no faster than the image's transition_slew and reference_limit_t.slew.
 * Then as said above. */
void loop_condition(void);

/** Counters to zero; sticky faults to those that are live. */
void loop_clear(void);

#endif
