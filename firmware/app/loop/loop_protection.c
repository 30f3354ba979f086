/* SPDX-License-Identifier: MIT */
/* What trips, and what stops motion. docs/DESIGN.md, section 4. */
#include "loop/capture.h"
#include "loop/loop_memory.h"
#include "protection/health_watch.h"

void loop_stop_source(void) {
    if (loop.source.playing) {
        loop.source.value = loop.reference;
        source_stop(&loop.source);
    }
}

void loop_stop_motion(void) {
    loop_stop_source();
    if (loop.conditioning.leg != CONDITIONING_OFF) {
        loop.conditioning.leg = CONDITIONING_OFF;
        if (loop.mode == HYST_MODE_DIRECT) {
            loop.source.value = loop.source.setpoint = loop.reference = loop.conditioning.reference;
        }
    }
}

void loop_to_park(void) {
    loop_stop_motion();
    loop.mode = HYST_MODE_PARK;
}

/* What is to be protected from runs: not what is parked, which a silent master may leave alone. */
static bool moving(void) {
    return loop.power.state == POWER_ON && (loop.mode != HYST_MODE_PARK || loop.conditioning.leg != CONDITIONING_OFF);
}

/* The faults of this sample that trip. */
static uint32_t tripping(uint32_t board_faults, uint32_t missed, uint32_t unhealthy) {
    uint32_t faults = unhealthy | (board_faults & FAULT_SUPPLY);
    if (loop.current > loop.current_limit && loop.power.state == POWER_ON) {
        faults |= FAULT_CURRENT;
    }
    if (!loop.image_whole && loop.power.state == POWER_PRECHARGE) {
        faults |= FAULT_IMAGE;
    }
    const bool adopting = atomic_load_explicit(&loop.pending, memory_order_relaxed) != NULL;
    loop.overruns_in_a_row = (board_faults & FAULT_OVERRUN) != 0 && !adopting ? loop.overruns_in_a_row + 1U : 0;
    if (loop.overruns_in_a_row >= LOOP_OVERRUNS_TO_TRIP) {
        loop.overruns_in_a_row = 0;
        faults |= FAULT_OVERLOAD;
    }
    loop.missed += missed;
    loop.silence += moving() ? 1U + missed : 0U;
    if (loop.silence > loop.timeout) {
        loop.silence = 0;
        faults |= FAULT_WATCHDOG;
    }
    return faults;
}

static void trip(uint32_t faults) {
    loop_to_park();
    if (loop.power.state != POWER_FAULT) {
        capture_event(CAPTURE_AT_FAULT);
    }
    power_trip(&loop.power, faults);
    loop.standing_faults |= faults;
    loop.bypass = loop.bypass || (faults & (FAULT_OVERLOAD | FAULT_IMAGE)) != 0;
}

/* Protections, before anything is computed. Reaction time: this sample's drive is the first of the ramp. */
void loop_protect(uint32_t board_faults, uint32_t missed, uint32_t unhealthy) {
    const bool parked = loop.compensator.drive == loop.active->range.park;
    const uint32_t faults = tripping(board_faults, missed, unhealthy);
    if (faults != 0 && ((faults & FAULT_OVERLOAD) != 0 || loop.power.state != POWER_OFF)) {
        trip(faults);
    }
    const uint32_t failed = power_sample(&loop.power, parked, health_watch_outside());
    if (failed != 0) {
        trip(failed);
    }
    if (loop.bypass && loop.image_whole && loop.power.state == POWER_OFF) {
        loop.bypass = false;
        hyst_compensator_reset(&loop.active->compensator, &loop.compensator); /* as after a start */
    }
    board_stage_enable(power_stage_enabled(&loop.power, parked));
}
