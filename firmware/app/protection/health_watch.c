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
    unsigned next;
    uint32_t looks;
    uint32_t stuck;          /* turns in a row at whose ends the output did not follow */
    volatile uint32_t stall; /* periods since the main loop came round */
    uint32_t stall_most;     /* more are a fault */
    uint32_t warnings;
    volatile uint32_t faults;
} watch;

void health_watch_init(void) {
    watch.next = 0;
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
    } else if (*count < watch.looks) {
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

/* The fourth of four looks. */
static void look_at_the_rest(void) {
    watch.stall += HEALTH_WATCH_TURN;
    const uint32_t faults = with(watch.faults, FAULT_STALL, watch.stall > watch.stall_most);
    watch.faults = with(faults, FAULT_OUTPUT, debounced(&watch.stuck, !board_output_follows()));
}

void health_watch_main_turned(void) {
    watch.stall = 0;
}

void health_watch_missed(uint32_t periods) {
    watch.stall += periods;
}

/* A reading of a channel that was seen. */
static void judge(channel_t *channel, int32_t x, bool counts) {
    const bool trips = debounced(&channel->tripping, counts && outside(channel, x));
    const bool warns = debounced(&channel->alerting, counts && (x < channel->alert_low || x > channel->alert_high));
    watch.faults = with(watch.faults, channel->fault, trips);
    watch.warnings = with(watch.warnings, channel->warning, warns);
}

uint32_t health_watch_look(bool stage_up) {
    const unsigned which = watch.next;
    watch.next = which < HEALTH_CHANNELS ? which + 1U : 0;
    if (which == HEALTH_CHANNELS) {
        look_at_the_rest();
        return watch.faults;
    }
    channel_t *channel = &watch.channel[which];
    const int32_t x = board_health((health_channel_t)which);
    channel->reading = x;
    channel->seen = channel->seen || x != HEALTH_ABSENT;
    if (channel->seen) {
        judge(channel, x, which != HEALTH_HIGH_VOLTAGE || stage_up);
    }
    return watch.faults;
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
