/* SPDX-License-Identifier: MIT */
/**
 * Temperature and supplies, as far as the board measures them (board_health): an alert, which is a warning, and limits
 * beyond which it trips.
 *
 * One channel is looked at every HEALTH_WATCH_EVERY samples, in turn, and in steps, each in another sample, so
 * that none costs much. Debounce: what is outside in so many looks of a channel in a row counts, and one look inside
 * ends it.
 *
 *   temperature    above the alert warns, above the trip trips. Below HEALTH_COLDEST warns, too: a sensor that is lost
 *   supply         outside of its limits trips
 *   high voltage   likewise, but only while the stage is up: before that it is none
 *
 * The fourth look of each turn is at two more: whether the drive's converter holds what it was given
 * (board_output_follows; debounced likewise), and whether the main loop has come round within HEALTH_WATCH_STALL_MS.
 * Both trip.
 *
 * A channel that the board does not have (HEALTH_ABSENT) is never outside. One that was there and is no more is: the
 * temperature warns, a supply trips. The self test at the end of precharge asks for all of them as last read, without
 * debounce: the stage's supply has to be up before the drive may move.
 */
#ifndef HEALTH_WATCH_H
#define HEALTH_WATCH_H

#include "board.h"
#include "protection/power_state.h"

/** A power of two. */
#define HEALTH_WATCH_EVERY 32U

/** Samples between two looks at a channel: 12.8 ms at 10 kHz. */
#define HEALTH_WATCH_TURN ((HEALTH_CHANNELS + 1U) * HEALTH_WATCH_EVERY)

/** The steps of a look, in the order of the samples. */
typedef enum {
    HEALTH_WATCH_JUDGE,   /**< is what was read outside of the limits? This trips */
    HEALTH_WATCH_WARN,    /**< is it beyond the alert? */
    HEALTH_WATCH_CONVERT, /**< the board's next conversion */
    HEALTH_WATCH_READ,    /**< reads the next channel */
    HEALTH_WATCH_STEPS
} health_watch_step_t;
#define HEALTH_WATCH_EACH_STEP (HEALTH_WATCH_EVERY / HEALTH_WATCH_STEPS)

/** The debounce count after start: an eighth of a second at 10 kHz. */
#define HEALTH_WATCH_LOOKS 10U

/** And at most: 1.3 s at 10 kHz. */
#define HEALTH_WATCH_LOOKS_MAX 100U

/** A main loop that stands still trips, by a ramp, so that the hardware watchdog does not cut the stage at whatever
 * drive there is. In steps of a turn of looks. The longest turn of the main loop is an answer of 256 bytes at 9600
 * baud: 0.29 s. Limitation: an image with three cascades of filters that ring for 2^16 samples each may take longer to
 * check while the loop runs (estimated from the instructions of a filter, not measured). Its commit trips then. */
#define HEALTH_WATCH_STALL_MS 400U

/** 0.001 C: below this is no temperature that an amplifier has. */
#define HEALTH_COLDEST (-40000)

/** Nothing seen, the board's limits. Before the sample interrupt runs. */
void health_watch_init(void);

/** Main loop, under board_lock. looks: 1 or more. What was counted stays: limits that are written again and again hold
 * nothing off. */
void health_watch_set_limits(const board_health_limits_t *limits, uint32_t looks);

/** Sample interrupt, every HEALTH_WATCH_EACH_STEP samples, the steps in turn. HEALTH_WATCH_JUDGE returns the FAULT_
 * bits of what is outside of its limits, stuck or stalled, the others none. */
uint32_t health_watch_step(health_watch_step_t step, power_t power);

/** The main loop has come round. Any context: one word. */
void health_watch_main_turned(void);

/** So many periods passed without a sample, and without being counted. Sample interrupt. */
void health_watch_missed(uint32_t periods);

/** FAULT_ bits of what is outside of its limits in the last look of its channel, whether the stage is up or not. Sample
 * interrupt. */
uint32_t health_watch_outside(void);

/** WARNING_ bits. */
uint32_t health_watch_warnings(void);

/** The same FAULT_ bits as of the last look. Any context: one word. */
uint32_t health_watch_faults(void);

/** The last reading, or HEALTH_ABSENT. Any context: one word. */
int32_t health_watch_reading(health_channel_t channel);

#endif
