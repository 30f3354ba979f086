/* SPDX-License-Identifier: MIT */
/* The main loop's side of the loop (loop.h). It touches the loop's memory under board_lock only, or a word that is read
 * or written whole. */
#include "loop/capture.h"
#include "loop/loop_memory.h"
#include "protection/health_watch.h"
#include "protection/model_watch.h"

/* A sample that comes between is followed by none as soon: the next one is a period later. */
#define REST_READS 3U

/* The main loop's way to what the interrupt owns. */
static uint32_t take(void) {
    const uint32_t key = board_lock();
    loop.attend |= ATTEND_ALL;
    return key;
}

static void limit_range(loop_parameters_t *parameters) {
    const drive_range_t *image = &parameters->image_range;
    parameters->range = *image;
    parameters->range.low = image->low > loop.drive_low ? image->low : loop.drive_low;
    parameters->range.high = image->high < loop.drive_high ? image->high : loop.drive_high;
    parameters->range.slew = loop.drive_slew;
    parameters->range.return_slew = image->return_slew < loop.drive_slew ? image->return_slew : loop.drive_slew;
}

static bool holds_park(const loop_parameters_t *parameters, hyst_q31_t low, hyst_q31_t high) {
    return parameters == NULL || (parameters->image_range.park >= low && parameters->image_range.park <= high);
}

bool loop_limit_range(loop_parameters_t *next) {
    limit_range(next);
    return holds_park(next, loop.drive_low, loop.drive_high);
}

bool loop_drive_limits_possible(hyst_q31_t low, hyst_q31_t high) {
    const uint32_t key = board_lock();
    const bool possible = low < high && holds_park(loop.active, low, high) &&
                          holds_park(atomic_load_explicit(&loop.pending, memory_order_relaxed), low, high);
    board_unlock(key);
    return possible;
}

/* What is in force and what waits to be. */
static void limit_ranges(void) {
    loop_parameters_t *next = atomic_load_explicit(&loop.pending, memory_order_relaxed);
    limit_range(loop.active);
    if (next != NULL) {
        limit_range(next);
    }
}

bool loop_set_drive_limits(hyst_q31_t low, hyst_q31_t high) {
    if (!loop_drive_limits_possible(low, high)) {
        return false;
    }
    const uint32_t key = take();
    loop.drive_low = low;
    loop.drive_high = high;
    limit_ranges();
    board_unlock(key);
    return true;
}

void loop_set_drive_slew(hyst_q31_t slew) {
    const uint32_t key = take();
    loop.drive_slew = slew;
    limit_ranges();
    board_unlock(key);
}

void loop_set_reference_limit(const reference_limit_t *limit) {
    const uint32_t key = take();
    loop.limit = *limit;
    board_unlock(key);
}

void loop_set_health_limits(const board_health_limits_t *limits, uint32_t looks) {
    const uint32_t key = take();
    health_watch_set_limits(limits, looks);
    board_unlock(key);
}

bool loop_adoption_pending(void) {
    return atomic_load_explicit(&loop.pending, memory_order_acquire) != NULL;
}

bool loop_adopt(loop_parameters_t *next) {
    if (loop_adoption_pending()) {
        return false;
    }
    const uint32_t key = board_lock();
    loop.attend |= ATTEND_ADOPTION;
    atomic_store_explicit(&loop.pending, next, memory_order_release);
    board_unlock(key);
    return true;
}

hyst_mode_t loop_mode(void) {
    return *(volatile hyst_mode_t *)&loop.mode; /* one word: read whole. A trip writes it, too */
}

/* Whatever the mode: before the stage is on, and while conditioning, which ends there. Under board_lock. */
static bool goes_to_park(void) {
    return loop.power.state != POWER_ON || loop.conditioning.leg != CONDITIONING_OFF;
}

/* The reference at which this mode begins without moving anything. Not under a lock, as it takes long: read again when
 * a sample came between. At rest, where it matters, they all have the same. */
static hyst_q31_t reference_at_rest(hyst_mode_t mode) {
    hyst_q31_t drive, position;
    const loop_parameters_t *active;
    uint32_t sample;
    unsigned reads = 0;
    do {
        sample = loop_samples();
        const uint32_t key = board_lock();
        active = loop.active;
        drive = goes_to_park() ? active->range.park : loop.compensator.drive;
        board_unlock(key);
        position = hyst_compensator_position(&active->compensator, &loop.compensator);
        atomic_signal_fence(memory_order_seq_cst);
        reads++;
    } while (loop_samples() != sample && reads < REST_READS);
    return hyst_compensator_rest(&active->compensator, mode, drive, position);
}

/* Under board_lock. */
static void begin_at(hyst_q31_t rest) {
    const hyst_q31_t from = hyst_clamp(rest, loop.limit.low, loop.limit.high);
    loop.source.value = loop.reference = from;
    if (!loop.setpoint_given) {
        loop.source.setpoint = from;
    }
}

/* A fault may come between the check of a request and this: then the fault has it. */
void loop_set_mode(hyst_mode_t mode) {
    const hyst_q31_t rest = mode != HYST_MODE_PARK && loop_mode() == HYST_MODE_PARK ? reference_at_rest(mode) : 0;
    const uint32_t key = take();
    if (mode == HYST_MODE_PARK) {
        loop_to_park();
        loop.setpoint_given = false;
    } else if (power_armed(&loop.power)) {
        if (loop.mode == HYST_MODE_PARK) {
            loop.silence = 0;
            loop.settles = goes_to_park();
            begin_at(rest);
        }
        loop.mode = mode;
    }
    board_unlock(key);
}

void loop_settle(void) {
    if (!loop.settles) {
        return;
    }
    const hyst_mode_t mode = loop_mode();
    const hyst_q31_t rest = mode != HYST_MODE_PARK ? reference_at_rest(mode) : 0;
    const uint32_t key = board_lock();
    loop.settles = loop.mode != HYST_MODE_PARK && goes_to_park();
    if (loop.settles) {
        begin_at(rest);
    }
    board_unlock(key);
}

bool loop_arm(bool image_whole) {
    const uint32_t key = take();
    const bool armed = power_arm(&loop.power, loop_samples_in(POWER_PRECHARGE_MS),
                                 loop_samples_in(POWER_SELF_TEST_MS - POWER_PRECHARGE_MS));
    loop.image_whole = loop.image_whole && image_whole;
    board_unlock(key);
    return armed;
}

void loop_image_damaged(void) {
    const uint32_t key = take();
    loop.image_whole = false;
    board_unlock(key);
}

void loop_disarm(void) {
    const uint32_t key = take();
    loop_to_park();
    loop.setpoint_given = false;
    power_disarm(&loop.power);
    board_unlock(key);
}

static power_t power_state(void) {
    return *(volatile power_t *)&loop.power.state; /* one word: read whole */
}

bool loop_armed(void) {
    const power_t state = power_state();
    return state == POWER_PRECHARGE || state == POWER_ON;
}

bool loop_ready(void) {
    return power_state() == POWER_ON;
}

bool loop_in_fault(void) {
    return power_state() == POWER_FAULT;
}

bool loop_off(void) {
    const uint32_t key = board_lock();
    const bool off =
        loop.power.state == POWER_OFF && loop.compensator.drive == loop.active->range.park && !loop_adoption_pending();
    board_unlock(key);
    return off;
}

uint16_t loop_park_code(void) {
    const uint32_t key = board_lock();
    const uint16_t code = loop_park_code_of(loop.active);
    board_unlock(key);
    return code;
}

uint32_t loop_samples(void) {
    return *(volatile uint32_t *)&loop.telemetry.sequence; /* one word: read whole */
}

uint32_t loop_periods(void) {
    const uint32_t key = board_lock();
    const uint32_t periods = loop.telemetry.sequence + loop.missed;
    board_unlock(key);
    return periods;
}

void loop_master_heard(void) {
    *(volatile uint32_t *)&loop.silence = 0; /* one word: written whole */
}

void loop_set_storing(bool storing) {
    const uint32_t key = take();
    loop.storing = storing;
    board_unlock(key);
}

void loop_set_timeout(uint32_t milliseconds) {
    const uint32_t key = board_lock();
    loop.timeout = milliseconds != 0 ? loop_samples_in(milliseconds) : UINT32_MAX;
    loop.silence = 0;
    board_unlock(key);
}

hyst_q31_t loop_setpoint(void) {
    const uint32_t key = board_lock();
    const hyst_q31_t setpoint =
        loop.mode == HYST_MODE_PARK && !loop.setpoint_given ? loop.active->range.park : loop.source.setpoint;
    board_unlock(key);
    return setpoint;
}

void loop_set_setpoint(hyst_q31_t setpoint) {
    const uint32_t key = board_lock();
    loop.source.setpoint = setpoint;
    loop.setpoint_given = true;
    board_unlock(key);
}

void loop_set_setpoint_slew(hyst_q31_t slew) {
    const uint32_t key = board_lock();
    loop.source.slew = slew;
    board_unlock(key);
}

void loop_start(const source_settings_t *settings) {
    const uint32_t key = take();
    if (loop.power.state != POWER_ON || loop.mode == HYST_MODE_PARK) {
        board_unlock(key); /* a fault came first */
        return;
    }
    source_start(&loop.source, settings);
    if (settings->kind == SOURCE_SINE) {
        hyst_hysteresis_begin_sine(&loop.active->compensator.hysteresis, hyst_compensator_memory(&loop.compensator));
    }
    capture_source_started(loop_alignment_of_reference());
    board_unlock(key);
}

bool loop_plays(source_kind_t kind) {
    const uint32_t key = board_lock();
    const bool playing = loop.source.playing && loop.source.settings.kind == kind;
    board_unlock(key);
    return playing;
}

uint32_t loop_tones(void) {
    const uint32_t key = board_lock();
    const source_t *source = &loop.source;
    const bool plays = source->playing && source->settings.kind == SOURCE_MULTISINE;
    const uint32_t tones = plays ? source->settings.tone_count : 0U;
    board_unlock(key);
    return tones;
}

bool loop_conditioning(void) {
    const uint32_t key = board_lock();
    const bool conditioning = loop.conditioning.leg != CONDITIONING_OFF;
    board_unlock(key);
    return conditioning;
}

/* It trips where loop_current_average is above the limit. So the limit is the largest sum that is not: its average is
 * rounded down, and a sum below one unit does not decay any more. From 2^30 on no sum is above it. */
void loop_set_current_limit(hyst_q31_t limit) {
    const uint32_t units = (uint32_t)limit >> CURRENT_UNIT;
    const bool reachable = limit > 0 && units < UINT32_MAX >> CURRENT_BITS;
    const uint32_t key = board_lock();
    loop.current_limit = reachable ? ((units + 1U) << CURRENT_BITS) - 1U : UINT32_MAX;
    board_unlock(key);
}

hyst_q31_t loop_current_average(void) {
    const uint32_t units = *(volatile uint32_t *)&loop.current >> CURRENT_BITS; /* one word: read whole */
    return hyst_saturate((int64_t)units << CURRENT_UNIT);
}

uint32_t loop_trips(uint32_t *cause) {
    const uint32_t key = board_lock();
    const uint32_t trips = loop.power.trips;
    *cause = loop.power.last_trip;
    board_unlock(key);
    return trips;
}

uint32_t loop_warnings(void) {
    return *(volatile uint32_t *)&loop.telemetry.warnings_live;
}

void loop_set_model_limit(hyst_q31_t limit, uint32_t milliseconds) {
    const uint32_t key = board_lock();
    model_watch_set_limit(limit, loop_samples_in(milliseconds));
    loop.model_warns = false;
    board_unlock(key);
}

void loop_stop(void) {
    const uint32_t key = take();
    loop_stop_motion();
    loop.source.value = loop.reference;
    source_stop(&loop.source); /* a setpoint that it is on its way to, too */
    loop.setpoint_given = false;
    if (power_leave_fault(&loop.power)) {
        limit_range(loop.active); /* a fault's ramp may have been a faster one */
        loop.standing_faults &= ~TRIPS;
    }
    board_unlock(key);
}

void loop_condition(void) {
    const uint32_t key = take();
    if (!power_armed(&loop.power)) {
        board_unlock(key); /* a fault came first */
        return;
    }
    loop.silence = 0;
    loop_stop_source();
    /* In direct mode a transition may still be part of the drive: go on from the reference, not from the drive. */
    conditioning_start(&loop.conditioning, loop.compensator.mode == HYST_MODE_DIRECT
                                               ? loop_past[loop.telemetry.sequence % HISTORY].reference
                                               : loop.compensator.drive);
    board_unlock(key);
}

void loop_clear(void) {
    const uint32_t key = take();
    telemetry_t *t = &loop.telemetry;
#define COUNTER(name, address, note, text) t->name = 0;
#include "registers/registers.def"
    loop_limits = (limit_counts_t){0};
    t->current_peak = 0;
    t->cost_last = t->cost_max = 0;
    t->faults_sticky = t->fault_first = 0;
    t->warnings_sticky = t->warnings_live;
    model_watch_clear();
    loop_note_faults(loop.standing_faults);
    board_unlock(key);
}
