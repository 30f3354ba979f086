/* SPDX-License-Identifier: MIT */
#include "loop.h"
#include "board.h"
#include "capture.h"
#include "conditioning.h"
#include <stdatomic.h>

/* Past samples, for the alignment. A power of two above the longest delay. */
#define HISTORY 128U
_Static_assert(HISTORY > BOARD_LATENCY_MAX + HYST_LOOKAHEAD_MAX, "history covers the longest delay");

/*
 * Owned by the sample interrupt once it runs. The main loop touches it under board_lock, for a bounded few words at a
 * time, and hands parameters over by the pointer `pending`.
 */
static struct {
    const loop_parameters_t *active;
    const loop_parameters_t *_Atomic pending;
    hyst_compensator_state_t compensator;
    hyst_mode_t mode;
    source_t source;
    conditioning_t conditioning;
    hyst_q31_t conditioning_rate;
    struct {
        hyst_q31_t reference;
        uint16_t drive_code;
        hyst_q31_t drive;
    } past[HISTORY];
    uint32_t standing_faults; /* live until something ends them */
    telemetry_t telemetry;
} loop;

static hyst_q31_t from_code(uint16_t code) {
    return (hyst_q31_t)((uint32_t)(code ^ BOARD_CODE_MIDDLE) << 16);
}

/* The nearest code of `bits` bits, left-aligned, as a signed number: value = code / 2^15. */
static int16_t to_code(hyst_q31_t value, unsigned bits) {
    const unsigned unused = 32U - bits;
    const int64_t top = INT32_MAX >> unused;
    const int64_t rounded = hyst_round_shift(value, unused); /* -2^(bits-1) .. 2^(bits-1) */
    return (int16_t)((rounded > top ? top : rounded) * ((int64_t)1 << (16U - bits)));
}

static void count(uint32_t *counter, bool happened) {
    if (happened && *counter < UINT32_MAX) {
        (*counter)++;
    }
}

/* One converter range, 2^32, per second. */
static hyst_q31_t range_per_second(void) {
    const uint64_t rate = ((uint64_t)1000U << 32) / board_info.sample_rate_mhz;
    return rate < HYST_Q31_MAX ? (hyst_q31_t)rate : HYST_Q31_MAX;
}

static void note_faults(uint32_t faults) {
    telemetry_t *t = &loop.telemetry;
    if (t->faults_sticky == 0 && faults != 0) {
        t->fault_first = 1;
        while ((faults >> (t->fault_first - 1U) & 1U) == 0) {
            t->fault_first++;
        }
    }
    t->faults_live = faults;
    t->faults_sticky |= faults;
}

void loop_init(const loop_parameters_t *parameters, uint16_t faults) {
    loop.active = parameters;
    atomic_store(&loop.pending, NULL);
    hyst_compensator_reset(&parameters->compensator, &loop.compensator);
    loop.mode = HYST_MODE_PARK;
    source_reset(&loop.source, 0, LOOP_DEFAULT_SLEW);
    loop.conditioning.leg = CONDITIONING_OFF;
    loop.conditioning_rate = range_per_second();
    const hyst_q31_t park = parameters->compensator.drive_park;
    for (unsigned i = 0; i < HISTORY; i++) {
        loop.past[i].reference = 0;
        loop.past[i].drive = park;
        loop.past[i].drive_code = (uint16_t)to_code(park, board_info.drive_bits);
    }
    loop.standing_faults = faults;
    loop.telemetry = (telemetry_t){.state = LOOP_PARKED, .drive = park};
    note_faults(faults);
    telemetry_publish(&loop.telemetry);
    capture_init();
}

/* The hold source's value becomes drive_park, where conditioning ends. In the other modes the reference is a position,
 * and the change of mode makes a transition of the difference. */
static void conditioning_ended(void) {
    if (loop.mode == HYST_MODE_DIRECT) {
        loop.source.value = loop.active->compensator.drive_park;
    }
}

/* What the compensator is to do in this sample. Returns the reference. */
static hyst_q31_t next_reference(hyst_mode_t *mode) {
    const hyst_compensator_t *c = &loop.active->compensator;
    if (loop.conditioning.leg != CONDITIONING_OFF) {
        if (conditioning_continues(&loop.conditioning, c, loop.compensator.drive)) {
            *mode = HYST_MODE_DIRECT;
            return conditioning_step(&loop.conditioning, c, loop.conditioning_rate);
        }
        conditioning_ended();
    }
    *mode = loop.mode;
    return source_step(&loop.source);
}

static void adopt_pending(void) {
    const loop_parameters_t *next = atomic_load_explicit(&loop.pending, memory_order_acquire);
    if (next != NULL && hyst_compensator_adopt(&loop.active->compensator, &next->compensator, &loop.compensator)) {
        loop.active = next;
        atomic_store_explicit(&loop.pending, NULL, memory_order_release);
    }
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

static uint32_t alignment_of_reference(void) {
    return board_info.latency_samples + loop.active->lookahead_samples;
}

/* Counters and the values that belong to this position. */
static void account(const loop_input_t *input, unsigned events, hyst_mode_t mode) {
    telemetry_t *t = &loop.telemetry;
    const uint32_t now = t->sequence;
    t->state = state_of(mode);
    t->active_mode = mode;
    t->reference = loop.past[(now - alignment_of_reference()) % HISTORY].reference;
    t->drive = loop.past[(now - board_info.latency_samples) % HISTORY].drive;
    t->position = from_code(input->position_code);
    count(&t->samples, true);
    count(&t->drive_limited, (events & HYST_STEP_DRIVE_LIMITED) != 0);
    count(&t->unreachable, (events & HYST_STEP_UNREACHABLE) != 0);
    count(&t->filter_saturated, (events & HYST_STEP_FILTER_SATURATED) != 0);
    count(&t->overruns, input->overrun);
    count(&t->converter_timeouts, input->converter_timeout);
    note_faults(loop.standing_faults | (input->overrun ? FAULT_OVERRUN : 0U) |
                (input->converter_timeout ? FAULT_CONVERTER_TIMEOUT : 0U));
}

static void capture_aligned(const loop_input_t *input) {
    const telemetry_t *t = &loop.telemetry;
    const capture_frame_t frame = {
        .reference = to_code(t->reference, 16),
        .drive = (int16_t)loop.past[(t->sequence - board_info.latency_samples) % HISTORY].drive_code,
        .position = (int16_t)(input->position_code ^ BOARD_CODE_MIDDLE)};
    capture_sample(&frame);
    loop.telemetry.capture_state = capture_state();
    loop.telemetry.capture_frames = capture_frames();
}

/*
 * Called once a sample period (100 us on the boards), which is also its deadline. Cost: docs/TIMING.md. What happens
 * when a sample comes late is the board's to say; here it is counted and reported.
 */
uint16_t loop_sample(const loop_input_t *input) {
    const uint32_t start = board_cost_counter();
    telemetry_t *t = &loop.telemetry;
    t->sequence++;
    adopt_pending();

    hyst_mode_t mode;
    unsigned events;
    const hyst_q31_t reference = next_reference(&mode);
    const hyst_q31_t drive =
        hyst_compensator_step(&loop.active->compensator, &loop.compensator, mode, reference, &events);
    const uint16_t code = (uint16_t)to_code(drive, board_info.drive_bits);

    const uint32_t now = t->sequence % HISTORY;
    loop.past[now].reference = reference;
    loop.past[now].drive = drive;
    loop.past[now].drive_code = code;
    account(input, events, mode);
    capture_aligned(input);
    telemetry_publish(t);

    t->cost_last = board_cost_counter() - start;
    if (t->cost_last > t->cost_max) {
        t->cost_max = t->cost_last;
    }
    return code ^ BOARD_CODE_MIDDLE;
}

bool loop_adoption_pending(void) {
    return atomic_load_explicit(&loop.pending, memory_order_acquire) != NULL;
}

bool loop_adopt(const loop_parameters_t *next) {
    if (loop_adoption_pending()) {
        return false;
    }
    atomic_store_explicit(&loop.pending, next, memory_order_release);
    return true;
}

hyst_mode_t loop_mode(void) {
    return loop.mode; /* only the main loop writes it */
}

static void stop(void) {
    if (loop.source.playing) {
        source_stop(&loop.source);
    }
    if (loop.conditioning.leg != CONDITIONING_OFF) {
        loop.conditioning.leg = CONDITIONING_OFF;
        if (loop.mode == HYST_MODE_DIRECT) {
            loop.source.value = loop.source.setpoint = loop.conditioning.reference;
        }
    }
}

void loop_set_mode(hyst_mode_t mode) {
    const uint32_t key = board_lock();
    if (mode == HYST_MODE_PARK) {
        stop();
    }
    loop.mode = mode;
    loop.standing_faults &= ~(uint32_t)FAULT_WATCHDOG;
    board_unlock(key);
}

void loop_park_by_watchdog(void) {
    const uint32_t key = board_lock();
    stop();
    loop.mode = HYST_MODE_PARK;
    loop.standing_faults |= FAULT_WATCHDOG;
    board_unlock(key);
}

hyst_q31_t loop_setpoint(void) {
    return *(volatile hyst_q31_t *)&loop.source.setpoint; /* one word: read whole */
}

void loop_set_setpoint(hyst_q31_t setpoint) {
    const uint32_t key = board_lock();
    loop.source.setpoint = setpoint;
    board_unlock(key);
}

void loop_set_setpoint_slew(hyst_q31_t slew) {
    const uint32_t key = board_lock();
    loop.source.slew = slew;
    board_unlock(key);
}

void loop_start(const source_settings_t *settings) {
    const uint32_t key = board_lock();
    source_start(&loop.source, settings);
    if (settings->kind == SOURCE_SINE) {
        hyst_hysteresis_begin_sine(&loop.active->compensator.hysteresis, hyst_compensator_memory(&loop.compensator));
    }
    capture_source_started(alignment_of_reference());
    board_unlock(key);
}

bool loop_playing_breakpoints(void) {
    const uint32_t key = board_lock();
    const bool playing = loop.source.playing && loop.source.settings.kind == SOURCE_BREAKPOINTS;
    board_unlock(key);
    return playing;
}

bool loop_conditioning(void) {
    const uint32_t key = board_lock();
    const bool conditioning = loop.conditioning.leg != CONDITIONING_OFF;
    board_unlock(key);
    return conditioning;
}

void loop_stop(void) {
    const uint32_t key = board_lock();
    stop();
    board_unlock(key);
}

void loop_condition(void) {
    const uint32_t key = board_lock();
    if (loop.source.playing) {
        source_stop(&loop.source);
    }
    /* In direct mode a transition may still be part of the drive: go on from the reference, not from the drive. */
    conditioning_start(&loop.conditioning, loop.compensator.mode == HYST_MODE_DIRECT
                                               ? loop.past[loop.telemetry.sequence % HISTORY].reference
                                               : loop.compensator.drive);
    board_unlock(key);
}

void loop_clear(void) {
    const uint32_t key = board_lock();
    telemetry_t *t = &loop.telemetry;
    t->samples = t->drive_limited = t->unreachable = t->filter_saturated = 0;
    t->overruns = t->converter_timeouts = 0;
    t->cost_last = t->cost_max = 0;
    t->faults_sticky = t->fault_first = 0;
    note_faults(loop.standing_faults);
    board_unlock(key);
}
