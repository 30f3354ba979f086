/* SPDX-License-Identifier: MIT */
#include "protection/power_state.h"

void power_init(power_state_t *power) {
    *power = (power_state_t){.state = POWER_OFF};
}

bool power_arm(power_state_t *power, uint32_t samples, uint32_t patience) {
    if (power->state == POWER_FAULT) {
        return false;
    }
    if (!power_armed(power)) {
        power->state = POWER_PRECHARGE;
        power->precharge = samples;
        power->patience = patience;
    }
    return true;
}

void power_disarm(power_state_t *power) {
    if (power_armed(power)) {
        power->state = POWER_STOPPING;
    }
}

void power_trip(power_state_t *power, uint32_t cause) {
    if (power->state != POWER_FAULT) {
        power->state = POWER_FAULT;
        power->cause = power->last_trip = cause;
        power->trips++;
    }
}

bool power_leave_fault(power_state_t *power) {
    if (power->state != POWER_FAULT) {
        return false;
    }
    power->state = POWER_STOPPING;
    power->cause = 0;
    return true;
}

uint32_t power_sample(power_state_t *power, bool parked, uint32_t failing) {
    if (power->state == POWER_STOPPING && parked) {
        power->state = POWER_OFF;
    }
    /* The output rests first: an arming that interrupts a stop waits for the end of the ramp. */
    if (power->state != POWER_PRECHARGE || !parked) {
        return 0;
    }
    if (power->precharge > 0) {
        power->precharge--;
    } else if (failing == 0) {
        power->state = POWER_ON;
    } else if (power->patience > 0) {
        power->patience--;
    } else {
        return failing;
    }
    return 0;
}

bool power_stage(power_state_t *power, bool parked, bool stays) {
    if (parked) {
        power->stage = power_armed(power) && (power->stage || stays);
    }
    return power->stage;
}
