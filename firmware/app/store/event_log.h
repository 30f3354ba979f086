/* SPDX-License-Identifier: MIT */
/**
 * What happened since the start: the newest EVENT_LOG_LENGTH events with their time and cause. Block `events`: event n,
 * counted from 0, lies at place n % EVENT_LOG_LENGTH, four registers each: time in ms (U32), kind, detail.
 *
 * Main loop only. Faults and warnings are noticed by event_log_poll, so their time is that of the main loop's next
 * turn, some milliseconds late. The time is counted in 64 bits of periods; as a U32 of ms it wraps after 49 days.
 */
#ifndef EVENT_LOG_H
#define EVENT_LOG_H

#include <stddef.h>
#include <stdint.h>

#define EVENT_LOG_LENGTH    32U
#define EVENT_LOG_REGISTERS 4U

/** Second register but one of an event. Append only. */
typedef enum {
    EVENT_START = 1,   /**< detail: reset_cause */
    EVENT_COMMAND = 2, /**< detail: the command, of those that change the state */
    EVENT_COMMIT = 3,  /**< detail: fault_code */
    EVENT_TRIP = 4,    /**< detail: bits of faults_sticky */
    EVENT_WARNING = 5  /**< detail: warnings_live, when it changed */
} event_kind_t;

/** Empty but for the start. After loop_init. */
void event_log_init(uint16_t reset_cause);

/** Behind what event_log_poll finds: a trip is ahead of the command that ends it. */
void event_log_add(event_kind_t kind, uint16_t detail);

/** Each turn of the main loop. */
void event_log_poll(void);

/** Since the start. */
uint32_t event_log_count(void);

/** Register `index` of the block. */
uint16_t event_log_register(size_t index);

#endif
