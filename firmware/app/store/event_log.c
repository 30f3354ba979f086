/* SPDX-License-Identifier: MIT */
#include "store/event_log.h"
#include "board.h"
#include "loop/loop.h"

typedef struct {
    uint32_t milliseconds;
    uint16_t kind, detail;
} event_t;

static event_t events[EVENT_LOG_LENGTH];
static uint32_t count;
static uint64_t periods;         /* since the start */
static uint32_t periods_last;    /* loop_periods then, which wraps */
static uint32_t trips, warnings; /* as they were looked at last */

static uint64_t now(void) {
    const uint32_t present = loop_periods();
    periods += present - periods_last;
    periods_last = present;
    return periods;
}

static void add(event_kind_t kind, uint16_t detail) {
    events[count % EVENT_LOG_LENGTH] = (event_t){
        .milliseconds = (uint32_t)(now() * 1000000U / board_info.sample_rate_mhz),
        .kind = (uint16_t)kind,
        .detail = detail,
    };
    count++;
}

void event_log_init(uint16_t reset_cause) {
    for (unsigned i = 0; i < EVENT_LOG_LENGTH; i++) {
        events[i] = (event_t){0};
    }
    count = 0;
    periods = periods_last = loop_periods();
    trips = warnings = 0;
    add(EVENT_START, reset_cause);
}

void event_log_poll(void) {
    uint32_t cause;
    const uint32_t now_trips = loop_trips(&cause);
    const uint32_t now_warned = loop_warnings();
    (void)now(); /* more often than the loop's count wraps */
    if (now_trips != trips) {
        trips = now_trips;
        add(EVENT_TRIP, (uint16_t)cause);
    }
    if (now_warned != warnings) {
        warnings = now_warned;
        add(EVENT_WARNING, (uint16_t)warnings);
    }
}

void event_log_add(event_kind_t kind, uint16_t detail) {
    event_log_poll();
    add(kind, detail);
}

uint32_t event_log_count(void) {
    return count;
}

uint16_t event_log_register(size_t index) {
    const event_t *event = &events[index / EVENT_LOG_REGISTERS];
    switch (index % EVENT_LOG_REGISTERS) {
    case 0:
        return (uint16_t)(event->milliseconds >> 16);
    case 1:
        return (uint16_t)event->milliseconds;
    case 2:
        return event->kind;
    default:
        return event->detail;
    }
}
