/* SPDX-License-Identifier: MIT */
/* What a sample tells. */
#include "loop/capture.h"
#include "loop/loop_memory.h"

/* Number of the lowest bit, counted from 1; 0 for none. */
static uint32_t first_of(uint32_t bits) {
    uint32_t number = 0;
    while (bits != 0) {
        number++;
        bits = (bits & 1U) != 0 ? 0 : bits >> 1;
    }
    return number;
}

void loop_note_faults(uint32_t faults) {
    telemetry_t *t = &loop.telemetry;
    if (t->faults_sticky == 0 && faults != 0) {
        t->fault_first = first_of(faults);
    }
    t->faults_live = faults;
    t->faults_sticky |= faults;
}

static amplifier_state_t amplifier_state(void) {
    switch (loop.power.state) {
    case POWER_OFF:
        return AMPLIFIER_OFF;
    case POWER_PRECHARGE:
        return AMPLIFIER_PRECHARGE;
    case POWER_STOPPING:
        return AMPLIFIER_STOP;
    case POWER_FAULT:
        return AMPLIFIER_FAULT;
    case POWER_ON:
        break;
    }
    if (loop.conditioning.leg != CONDITIONING_OFF) {
        return AMPLIFIER_CONDITIONING;
    }
    return loop.source.playing ? AMPLIFIER_RUN : AMPLIFIER_HOLD;
}

static loop_state_t state_of(hyst_mode_t mode) {
    if (loop.conditioning.leg != CONDITIONING_OFF) {
        return LOOP_CONDITIONING;
    }
    if (mode == HYST_MODE_PARK) {
        return LOOP_PARKED;
    }
    return loop.source.playing ? LOOP_PLAYING : LOOP_IDLE;
}

void loop_report_warnings(uint32_t warnings) {
    telemetry_t *t = &loop.telemetry;
    if ((warnings & ~t->warnings_live) != 0) {
        capture_event(CAPTURE_AT_WARNING);
    }
    t->warnings_live = warnings;
    t->warnings_sticky |= warnings;
}

void loop_report(uint32_t faults, hyst_mode_t mode) {
    telemetry_t *t = &loop.telemetry;
    t->active_mode = mode;
    t->state = state_of(mode);
    t->amplifier_state = amplifier_state();
    t->trip_cause = first_of(loop.power.cause);
    loop.playing = loop.source.playing;
    if (loop.storing) {
        faults &= ~(uint32_t)FAULT_OVERRUN;
    }
    count(&t->overruns, (faults & FAULT_OVERRUN) != 0);
    count(&t->converter_timeouts, (faults & FAULT_CONVERTER_TIMEOUT) != 0);
    const uint32_t live = loop.standing_faults | faults;
    if (live != t->faults_live) {
        loop_note_faults(live);
    }
}

static uint16_t upper(hyst_q31_t value) {
    return (uint16_t)((uint32_t)value >> 16);
}

/* The signals beside the first three. Returns where the next one goes. */
static uint16_t *further_signals(uint16_t *to, uint16_t signals) {
    const telemetry_t *t = &loop.telemetry;
    const hyst_q31_t before = loop_past[(t->sequence - board_info.latency_samples - 1U) % HISTORY].drive;
    if ((signals & CAPTURE_ERROR) != 0) {
        *to++ = upper(hyst_saturate((int64_t)t->position - t->reference));
    }
    if ((signals & CAPTURE_CURRENT) != 0) {
        *to++ = upper(hyst_saturate((int64_t)t->drive - before));
    }
    if ((signals & CAPTURE_HYSTERESIS) != 0) {
        *to++ = upper(
            hyst_hysteresis_output(&loop.active->compensator.hysteresis, hyst_compensator_memory(&loop.compensator)));
    }
    if ((signals & CAPTURE_TRANSITION) != 0) {
        *to++ = upper(hyst_saturate(hyst_transition_value(loop.compensator.transition)));
    }
    return to;
}

HYST_APART uint16_t *loop_signals(uint16_t *to, uint16_t signals, uint16_t position_code) {
    const telemetry_t *t = &loop.telemetry;
    if ((signals & CAPTURE_REFERENCE) != 0) {
        *to++ = (uint16_t)loop_to_code(t->reference, 16);
    }
    if ((signals & CAPTURE_DRIVE) != 0) {
        *to++ = (uint16_t)loop_to_code(t->drive, board_info.drive_bits);
    }
    if ((signals & CAPTURE_POSITION) != 0) {
        *to++ = (uint16_t)(position_code ^ BOARD_CODE_MIDDLE);
    }
    return further_signals(to, signals);
}
