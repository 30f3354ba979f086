/* SPDX-License-Identifier: MIT */
#include "protection/health_watch.h"
#include "loop/telemetry.h"

typedef struct {
    int32_t low, high; /* outside of them it trips */
    int32_t alert_low, alert_high;
    uint32_t fault, warning;
    uint32_t tripping, alerting; /* looks in a row, at most `looks` */
    bool seen;                   /* there was a reading since the start */
    volatile int32_t reading;
} channel_t;

static struct {
    channel_t channel[HEALTH_CHANNELS];
    unsigned which;   /* looked at last; HEALTH_CHANNELS: all that is no channel */
    channel_t *place; /* of the same; NULL */
    uint32_t looks;
    uint32_t stuck;          /* turns in a row at whose ends the output did not follow */
    volatile uint32_t stall; /* periods since the main loop came round */
    uint32_t stall_most;     /* more are a fault */
    uint32_t warnings;
    volatile uint32_t faults;
} watch;

void health_watch_init(void) {
    watch.which = HEALTH_CHANNELS; /* a turn begins with the first */
    watch.place = NULL;
    watch.stuck = watch.stall = 0;
    watch.stall_most = (uint32_t)((uint64_t)HEALTH_WATCH_STALL_MS * board_info.sample_rate_mhz / 1000000U);
    watch.warnings = watch.faults = 0;
    for (unsigned i = 0; i < HEALTH_CHANNELS; i++) {
        watch.channel[i] = (channel_t){.reading = HEALTH_ABSENT};
    }
    health_watch_set_limits(&board_info.health, HEALTH_WATCH_LOOKS);
}

static void set_channel(health_channel_t which, int32_t low, int32_t high, uint32_t fault) {
    channel_t *channel = &watch.channel[which];
    channel->low = low;
    channel->high = high;
    channel->alert_low = INT32_MIN;
    channel->alert_high = INT32_MAX;
    channel->fault = fault;
    channel->warning = 0;
}

void health_watch_set_limits(const board_health_limits_t *limits, uint32_t looks) {
    set_channel(HEALTH_TEMPERATURE, INT32_MIN, limits->temperature_trip, FAULT_TEMPERATURE);
    set_channel(HEALTH_SUPPLY, limits->supply_low, limits->supply_high, FAULT_SUPPLY);
    set_channel(HEALTH_HIGH_VOLTAGE, limits->high_voltage_low, limits->high_voltage_high, FAULT_HIGH_VOLTAGE);
    watch.channel[HEALTH_TEMPERATURE].alert_low = HEALTH_COLDEST;
    watch.channel[HEALTH_TEMPERATURE].alert_high = limits->temperature_alert;
    watch.channel[HEALTH_TEMPERATURE].warning = WARNING_TEMPERATURE;
    watch.looks = looks;
}

/* One more look, outside or not. Returns whether it counts. */
static bool debounced(uint32_t *count, bool outside) {
    if (!outside) {
        *count = 0;
        return false;
    }
    if (*count < watch.looks) {
        (*count)++;
    }
    return *count >= watch.looks;
}

static uint32_t with(uint32_t bits, uint32_t bit, bool on) {
    return on ? bits | bit : bits & ~bit;
}

/* Of a channel that was seen. What vanished since is below all limits that there are. */
static bool outside(const channel_t *channel, int32_t x) {
    return x < channel->low || x > channel->high;
}

uint32_t health_watch_outside(void) {
    uint32_t faults = 0;
    for (unsigned i = 0; i < HEALTH_CHANNELS; i++) {
        const channel_t *channel = &watch.channel[i];
        faults = with(faults, channel->fault, channel->seen && outside(channel, channel->reading));
    }
    return faults;
}

/* Whether there is something to judge. */
static inline bool there(const channel_t *channel, power_t power) {
    return channel->seen && (channel != &watch.channel[HEALTH_HIGH_VOLTAGE] || power == POWER_ON);
}

_Static_assert(HEALTH_WATCH_WARN < HEALTH_WATCH_CONVERT && HEALTH_WATCH_READ + 1 == HEALTH_WATCH_STEPS,
               "the order in which steps are tested");
_Static_assert((HEALTH_CHANNELS & (HEALTH_CHANNELS + 1)) == 0, "a turn is a power of two");

static inline void read_next(void) {
    watch.which = (watch.which + 1U) & HEALTH_CHANNELS;
    channel_t *const channel = watch.which < HEALTH_CHANNELS ? &watch.channel[watch.which] : NULL;
    watch.place = channel;
    if (channel != NULL) {
        const int32_t x = board_health((health_channel_t)watch.which);
        channel->reading = x;
        channel->seen = channel->seen || x != HEALTH_ABSENT;
    }
}

/* The last look of a turn. */
static uint32_t look_at_the_rest(void) {
    watch.stall += HEALTH_WATCH_TURN;
    return with(watch.faults, FAULT_OUTPUT, debounced(&watch.stuck, !board_output_follows()));
}

static inline uint32_t look_at_channel(channel_t *channel, power_t power) {
    const bool trips = debounced(&channel->tripping, there(channel, power) && outside(channel, channel->reading));
    return with(watch.faults, channel->fault, trips);
}

/* A stall ends with the first look after it: a stop that ends it is not to trip again. */
static inline uint32_t judge(power_t power) {
    const uint32_t others = watch.place == NULL ? look_at_the_rest() : look_at_channel(watch.place, power);
    const uint32_t faults = with(others, FAULT_STALL, watch.stall > watch.stall_most);
    watch.faults = faults;
    return faults;
}

void health_watch_main_turned(void) {
    watch.stall = 0;
}

void health_watch_missed(uint32_t periods) {
    watch.stall += periods;
}

static inline void warn(power_t power) {
    channel_t *const channel = watch.place;
    if (channel != NULL) {
        const int32_t x = channel->reading;
        const bool alerts = there(channel, power) && (x < channel->alert_low || x > channel->alert_high);
        watch.warnings = with(watch.warnings, channel->warning, debounced(&channel->alerting, alerts));
    }
}

/* Tested in an order in which none of the four takes much more than the others. */
HYST_APART uint32_t health_watch_step(health_watch_step_t step, power_t power) {
    if (step == HEALTH_WATCH_CONVERT) {
        board_health_convert();
    } else if (step < HEALTH_WATCH_CONVERT) {
        if (step == HEALTH_WATCH_JUDGE) {
            return judge(power);
        }
        warn(power);
    } else {
        read_next();
    }
    return 0;
}

uint32_t health_watch_warnings(void) {
    return watch.warnings;
}

uint32_t health_watch_faults(void) {
    return watch.faults;
}

int32_t health_watch_reading(health_channel_t channel) {
    return watch.channel[channel].reading;
}
