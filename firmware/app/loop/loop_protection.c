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

static bool adopting(void) {
    return atomic_load_explicit(&loop.pending, memory_order_relaxed) != NULL;
}

/* The faults of this sample that trip. */
static uint32_t tripping(uint32_t board_faults, uint32_t missed, uint32_t unhealthy) {
    uint32_t faults = unhealthy | (board_faults & FAULT_SUPPLY);
    if (loop.current > loop.current_limit && loop.power.state == POWER_ON) {
        faults |= FAULT_CURRENT;
    }
    if (!loop.image_whole && power_armed(&loop.power)) {
        faults |= FAULT_IMAGE;
    }
    loop.overruns_in_a_row =
        (board_faults & FAULT_OVERRUN) != 0 && !adopting() && !loop.storing ? loop.overruns_in_a_row + 1U : 0;
    if (loop.overruns_in_a_row >= LOOP_OVERRUNS_TO_TRIP) {
        loop.overruns_in_a_row = 0;
        faults |= FAULT_OVERLOAD;
    }
    loop.missed += missed;
    health_watch_missed(missed);
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
        loop.feeds = loop.feeds_most;
    }
    power_trip(&loop.power, faults);
    loop.standing_faults |= faults;
    loop.bypass = loop.bypass || (faults & (FAULT_OVERLOAD | FAULT_IMAGE)) != 0;
}

/* The ramp is no slower than the board wants: the rest of a transition shrinks by that much more. And the hardware
 * watchdog does not cut it short. */
static void in_fault(bool stage) {
    drive_range_t *range = &loop.active->range;
    const hyst_q31_t slew = loop.active->image_range.return_slew;
    const hyst_q31_t least = board_info.fault_slew_min;
    const uint32_t faster = least > slew ? (uint32_t)least - (uint32_t)slew : 0;
    const uint32_t rest = loop.compensator.transition.size;
    const hyst_q31_t ramp = least > slew ? least : slew;
    range->return_slew = ramp < range->slew ? ramp : range->slew;
    loop.compensator.transition.size = rest > faster ? rest - faster : 0;
    if (stage && loop.feeds > 0) {
        loop.feeds--;
        board_watchdog_feed();
    }
}

/* Protections, before anything is computed. Reaction time: this sample's drive is the first of the ramp. */
void loop_protect(uint32_t board_faults, uint32_t missed, uint32_t unhealthy) {
    const bool parked = loop.compensator.drive == loop.active->range.park;
    const uint32_t faults = tripping(board_faults, missed, unhealthy);
    if (faults != 0 && ((faults & FAULT_OVERLOAD) != 0 || loop.power.state != POWER_OFF)) {
        trip(faults);
    }
    const uint32_t failing = loop.power.state == POWER_PRECHARGE ? health_watch_outside() : 0U;
    const uint32_t failed = power_sample(&loop.power, parked, failing);
    if (failed != 0) {
        trip(failed);
    }
    if (loop.bypass && loop.image_whole && parked && loop.power.state != POWER_FAULT) {
        loop.bypass = false;
        hyst_compensator_reset(&loop.active->compensator, &loop.compensator); /* as after a start */
    }
    const bool stage = power_stage(&loop.power, parked, !adopting());
    board_stage_enable(stage);
    if (loop.power.state == POWER_FAULT) {
        in_fault(stage);
    }
}
