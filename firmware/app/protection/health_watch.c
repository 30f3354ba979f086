/* SPDX-License-Identifier: MIT */
#include "protection/health_watch.h"
#include "loop/telemetry.h"

typedef struct {
    int32_t low, high; /* outside of them it trips */
    int32_t alert_low, alert_high;
    uint32_t fault, warning;
    uint32_t tripping, alerting; /* looks in a row, at most `looks` */
    volatile int32_t reading;
} channel_t;

static struct {
    channel_t channel[HEALTH_CHANNELS];
    channel_t *looked_at;
    uint32_t looks;
    uint32_t warnings;
    volatile uint32_t faults;
} watch;

void health_watch_init(void) {
    watch.looked_at = &watch.channel[HEALTH_CHANNELS - 1U]; /* a look begins with the next one */
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
    channel->tripping = channel->alerting = 0;
}

void health_watch_set_limits(const board_health_limits_t *limits, uint32_t looks) {
    set_channel(HEALTH_TEMPERATURE, INT32_MIN, limits->temperature_trip, FAULT_TEMPERATURE);
    set_channel(HEALTH_SUPPLY, limits->supply_low, limits->supply_high, FAULT_SUPPLY);
    set_channel(HEALTH_HIGH_VOLTAGE, limits->high_voltage_low, limits->high_voltage_high, FAULT_HIGH_VOLTAGE);
    watch.channel[HEALTH_TEMPERATURE].alert_low = HEALTH_COLDEST;
    watch.channel[HEALTH_TEMPERATURE].alert_high = limits->temperature_alert;
    watch.channel[HEALTH_TEMPERATURE].warning = WARNING_TEMPERATURE;
    watch.looks = looks;
    watch.warnings = 0;
    watch.faults = 0;
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

static bool outside(const channel_t *channel, int32_t x) {
    return x != HEALTH_ABSENT && (x < channel->low || x > channel->high);
}

uint32_t health_watch_outside(void) {
    uint32_t faults = 0;
    for (unsigned i = 0; i < HEALTH_CHANNELS; i++) {
        const channel_t *channel = &watch.channel[i];
        faults = with(faults, channel->fault, outside(channel, channel->reading));
    }
    return faults;
}

/* Whether there is something to judge. */
static inline bool there(const channel_t *channel, bool stage_up) {
    return channel->reading != HEALTH_ABSENT && (stage_up || channel != &watch.channel[HEALTH_HIGH_VOLTAGE]);
}

static inline uint32_t read_and_judge(bool stage_up) {
    channel_t *const last = &watch.channel[HEALTH_CHANNELS - 1U];
    channel_t *const channel = watch.looked_at < last ? watch.looked_at + 1 : watch.channel;
    watch.looked_at = channel;
    channel->reading = board_health((health_channel_t)(channel - watch.channel));
    const bool trips = debounced(&channel->tripping, there(channel, stage_up) && outside(channel, channel->reading));
    const uint32_t faults = with(watch.faults, channel->fault, trips);
    watch.faults = faults;
    return faults;
}

static inline void warn(channel_t *channel, bool stage_up) {
    const int32_t x = channel->reading;
    const bool alerts = there(channel, stage_up) && (x < channel->alert_low || x > channel->alert_high);
    watch.warnings = with(watch.warnings, channel->warning, debounced(&channel->alerting, alerts));
}

HYST_APART uint32_t health_watch_step(health_watch_step_t step, bool stage_up) {
    switch (step) {
    case HEALTH_WATCH_JUDGE:
        return read_and_judge(stage_up);
    case HEALTH_WATCH_WARN:
        warn(watch.looked_at, stage_up);
        break;
    case HEALTH_WATCH_CONVERT:
        board_health_convert();
        break;
    case HEALTH_WATCH_PAUSE:
    case HEALTH_WATCH_STEPS:
        break;
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
