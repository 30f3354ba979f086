/* SPDX-License-Identifier: MIT */
/**
 * The parameter image in force, the one that is being uploaded, and the way from one to the other.
 *
 * A commit decodes and validates the staged image as a set and builds its coefficients in the idle half of a double
 * buffer; the loop adopts them (loop_adopt). A refused image changes nothing but the result. Besides what
 * hyst/parameters.h checks, the image must have been made for this board's sample rate
 * (HYST_PARAMETERS_INCONSISTENT, HYST_FIELD_SAMPLE_RATE), park within the output range that was set by registers
 * (HYST_FIELD_DRIVE_PARK) and ask for no more than the board allows (hyst/board_limits.h). Its worst sample must fit a
 * period at the processor's present clock and a byte of the line (HYST_PARAMETERS_TOO_COSTLY, HYST_FIELD_SAMPLE_RATE;
 * hyst/cost.h), beside the tones of a multisine that plays. What is stored is checked likewise at start.
 *
 * Main loop only.
 */
#ifndef PARAMETER_STORE_H
#define PARAMETER_STORE_H

#include "loop/loop.h"
#include "store/image_store.h"

/** Words of each of the two register blocks: the longest image. */
#define PARAMETER_STORE_WORDS HYST_IMAGE_MAX_WORDS

/** Puts the stored image in force (image_store.h), or, where there is none that is valid, the default image, for this
 * board's sample rate and parked at its safe code. `baud`: of the line. Returns what loop_init is to start with. */
loop_parameters_t *parameter_store_init(uint32_t baud);

/** The line has this rate from now on: a sample may take a period, and no longer than lets its bytes be received
 * (line_sample_budget). */
void parameter_store_set_rate(uint32_t baud);

/** Would the image in force leave time for the bytes of this rate? */
bool parameter_store_leaves_time_for(uint32_t baud);

/** Where an upload is written to. PARAMETER_STORE_WORDS words, in any order. */
uint32_t *parameter_store_staging(void);

/** The image in force. PARAMETER_STORE_WORDS words; 0 behind the image's length. */
const uint32_t *parameter_store_active(void);

/** Does a sample with the image in force leave time for so many tones of a multisine? */
bool parameter_store_has_time_for(uint32_t tones);

/** Was an image put in force, other than the one of parameter_store_init? Without one there are no limits, and the
 * amplifier cannot be armed. */
bool parameter_store_image_given(void);

/** Register `store_state`. */
typedef enum { STORE_NONE, STORE_LOADED, STORE_REFUSED, STORE_SAVED, STORE_FAILED } parameter_store_stored_t;

/** Result of the last commit, and how many were accepted since start (saturates at UINT16_MAX). */
typedef struct {
    hyst_parameters_fault_t fault;
    uint16_t commits;
    parameter_store_stored_t stored;
    uint32_t sequence;          /**< of the stored copy */
    uint32_t cost, cost_budget; /**< registers `image_cost` and `cost_budget`, cycles */
} parameter_store_status_t;

parameter_store_status_t parameter_store_status(void);

/** Are the coefficients that the last commit, or the start, built still what they were? Reads all of them: some
 * milliseconds on a Cortex-M4 (estimated, not measured on silicon). */
bool parameter_store_whole(void);

/** Each turn of the main loop: the same in portions, one for each PARAMETER_STORE_CHECK_US that have gone by, beginning
 * again at the end. A turn that comes late, as one that has sent an answer, makes up for it, some portions at a time.
 * The loop trips when what has been gone through is not what it was (loop_image_damaged): at most two passes after the
 * change and the time of an answer. Calculated for a Cortex-M4 at 168 MHz: 6.3 KB in portions of 60 bytes are 109 of
 * them, so a pass takes 0.09 s. An answer of 256 bytes takes 0.03 s at 115200 baud and 0.27 s at 9600. A portion takes
 * 30 us: 2600 instructions of 2 cycles. So 334 of them have to be made up for at 9600 baud. A master that never pauses
 * leaves little more time than that between two answers. Where samples take half of it, a change is found in 0.6 s. */
void parameter_store_check(void);
#define PARAMETER_STORE_CHECK_US 800U
/** Portions that a turn makes up for at most, and how many it may be behind. */
#define PARAMETER_STORE_CHECK_MOST   16U
#define PARAMETER_STORE_CHECK_BEHIND 256U

/** Stores the image in force with these limits, at most IMAGE_STORE_LIMITS_MAX. Only while loop_off(). */
void parameter_store_save(const stored_limit_t *limits, size_t count);

/** The limits that were stored with the image that is in force since start. 0 where it is not a stored one. */
size_t parameter_store_limits(stored_limit_t limits[IMAGE_STORE_LIMITS_MAX]);

/** The stored image came with limits that this firmware does not have, or that do not go together: STORE_REFUSED. It
 * still says where to park, and the amplifier cannot be armed. */
void parameter_store_refuse_limits(void);

/** The stored settings of the line; the default ones if none are stored, if this board cannot have them, or to forget
 * them. */
line_settings_t parameter_store_line(bool forget);

/** Stores valid settings of the line, beside the stored image if there is one. Only while loop_off(). False when the
 * flash did not take them. */
bool parameter_store_save_line(const line_settings_t *line);

/** Tries to put the staged image in force. Not while loop_adoption_pending(): the idle half is not idle then. */
void parameter_store_commit(void);

#endif
