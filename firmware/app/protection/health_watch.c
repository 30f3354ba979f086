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
    uint32_t stuck; /* looks in a row at which the output did not follow */
    uint32_t warnings;
    volatile uint32_t faults;
} watch;

void health_watch_init(void) {
    watch.next = 0;
    watch.stuck = 0;
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

/* What vanished: a channel that can warn warns, another one trips. */
static bool outside(const channel_t *channel, int32_t x) {
    return x == HEALTH_ABSENT ? channel->seen && channel->warning == 0 : x < channel->low || x > channel->high;
}

static bool alerting(const channel_t *channel, int32_t x) {
    return x == HEALTH_ABSENT ? channel->seen : x < channel->alert_low || x > channel->alert_high;
}

uint32_t health_watch_outside(void) {
    uint32_t faults = 0;
    for (unsigned i = 0; i < HEALTH_CHANNELS; i++) {
        const channel_t *channel = &watch.channel[i];
        faults = with(faults, channel->fault, outside(channel, channel->reading));
    }
    return faults;
}

uint32_t health_watch_look(bool stage_up) {
    const health_channel_t which = (health_channel_t)watch.next;
    channel_t *channel = &watch.channel[which];
    const int32_t x = board_health(which);
    const bool counts = which != HEALTH_HIGH_VOLTAGE || stage_up;
    const bool trips = debounced(&channel->tripping, counts && outside(channel, x));
    const bool warns = debounced(&channel->alerting, counts && alerting(channel, x));
    channel->seen = channel->seen || x != HEALTH_ABSENT;
    channel->reading = x;
    const uint32_t faults = with(watch.faults, channel->fault, trips);
    watch.faults = with(faults, FAULT_OUTPUT, debounced(&watch.stuck, !board_output_follows()));
    watch.warnings = with(watch.warnings, channel->warning, warns);
    watch.next = watch.next + 1U < HEALTH_CHANNELS ? watch.next + 1U : 0;
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
