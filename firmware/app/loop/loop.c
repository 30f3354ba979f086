/* SPDX-License-Identifier: MIT */
/* The sample. What it shares with the other files of the loop, and which these are: loop_memory.h. */
#include "loop/capture.h"
#include "loop/loop_memory.h"
#include "protection/health_watch.h"
#include "protection/model_watch.h"
#include "protection/sensor_watch.h"

loop_memory_t loop;
past_t loop_past[HISTORY];
limit_counts_t loop_limits;

static hyst_q31_t from_code(uint16_t code) {
    return (hyst_q31_t)((uint32_t)(code ^ BOARD_CODE_MIDDLE) << 16);
}

/* One converter range, 2^32, per second. */
static hyst_q31_t range_per_second(void) {
    const uint64_t rate = ((uint64_t)1000U << 32) / board_info.sample_rate_mhz;
    return rate < HYST_Q31_MAX ? (hyst_q31_t)rate : HYST_Q31_MAX;
}

void loop_init(loop_parameters_t *parameters, uint16_t faults) {
    loop.active = parameters;
    atomic_store(&loop.pending, NULL);
    hyst_compensator_reset(&parameters->compensator, &loop.compensator);
    loop.mode = HYST_MODE_PARK;
    source_reset(&loop.source, 0, LOOP_DEFAULT_SLEW);
    loop.limit = (reference_limit_t){.low = HYST_Q31_MIN, .high = HYST_Q31_MAX, .slew = board_info.drive_slew_max};
    loop.reference = 0;
    loop.drive_low = HYST_Q31_MIN;
    loop.drive_high = HYST_Q31_MAX;
    loop.drive_slew = board_info.drive_slew_max;
    loop.setpoint_given = loop.settles = false;
    loop.conditioning.leg = CONDITIONING_OFF;
    loop.conditioning_rate = range_per_second();
    const hyst_q31_t park = parameters->range.park;
    for (unsigned i = 0; i < HISTORY; i++) {
        loop_past[i].reference = 0;
        loop_past[i].drive = park;
    }
    loop.standing_faults = faults & ~(uint32_t)FAULT_SUPPLY; /* each sample says whether it is low */
    power_init(&loop.power);
    loop.image_whole = true;
    loop.bypass = false;
    loop.overruns_in_a_row = 0;
    loop.silence = 0;
    loop.missed = 0;
    loop.feeds = 0;
    loop.feeds_most = loop_samples_in(LOOP_FAULT_FEED_MS);
    loop.storing = false;
    loop.timeout = loop_samples_in(LOOP_DEFAULT_TIMEOUT_MS);
    loop.attend = ATTEND_ALL;
    loop.playing = false;
    loop.settling = loop_samples_in(LOOP_SETTLING_MS) + BOARD_LATENCY_MAX + HYST_LOOKAHEAD_MAX;
    loop.unsettled = loop.settling;
    loop.current = 0;
    loop.current_limit = UINT32_MAX;
    loop.model_warns = false;
    loop.telemetry = (telemetry_t){.state = LOOP_PARKED, .drive = park};
    loop_note_faults(faults);
    loop_limits = (limit_counts_t){0};
    telemetry_publish(&loop.telemetry, &loop_limits);
    capture_init();
    model_watch_init();
    sensor_watch_init();
    health_watch_init();
}

/* The hold source's value becomes drive_park, where conditioning ends. In the other modes the reference is a position,
 * and the change of mode makes a transition of the difference. */
static void conditioning_ended(void) {
    if (loop.mode == HYST_MODE_DIRECT) {
        loop.source.value = loop.reference = loop.active->range.park;
    }
}

/* Temperature, supplies and the main loop, a step of a look in some samples: the faults that it ends with. What is on
 * its way off goes there, unless the main loop stalls, and arming is refused while they last. */
static inline uint32_t look_at_health(void) {
    if (loop.telemetry.sequence % HEALTH_WATCH_EACH_STEP != 0) {
        return 0;
    }
    const uint32_t step = loop.telemetry.sequence / HEALTH_WATCH_EACH_STEP % HEALTH_WATCH_STEPS;
    const uint32_t faults = health_watch_step((health_watch_step_t)step, loop.power.state);
    return faults == 0 || power_armed(&loop.power) ? faults : faults & (uint32_t)FAULT_STALL;
}

/* As a transition, and no faster than any other reference. */
static hyst_q31_t conditioning_rate(const drive_range_t *range) {
    const hyst_q31_t slew = range->return_slew < loop.limit.slew ? range->return_slew : loop.limit.slew;
    return slew < loop.conditioning_rate ? slew : loop.conditioning_rate;
}

/* Whether something else than mode and source says what the compensator is to do, and what. */
static bool overruled(hyst_mode_t *mode, hyst_q31_t *reference) {
    const drive_range_t *range = &loop.active->range;
    if (loop.power.state != POWER_ON) {
        *mode = HYST_MODE_PARK;
        *reference = loop.reference;
        return true;
    }
    if (loop.conditioning.leg != CONDITIONING_OFF) {
        if (conditioning_continues(&loop.conditioning, range, loop.compensator.drive)) {
            *mode = HYST_MODE_DIRECT;
            *reference = conditioning_step(&loop.conditioning, range, conditioning_rate(range));
            return true;
        }
        conditioning_ended();
    }
    return false;
}

/* The source's, within its limits. */
static inline hyst_q31_t next_reference(unsigned *events) {
    bool held;
    loop.reference = reference_limited(&loop.limit, loop.reference, source_step(&loop.source), &held);
    *events = held ? REFERENCE_LIMITED : 0U;
    return loop.reference;
}

/* Nothing of a damaged image is carried over. The output goes on from where it is. */
static void begin_anew(const loop_parameters_t *next) {
    const hyst_q31_t drive = loop.compensator.drive;
    hyst_compensator_reset(&next->compensator, &loop.compensator);
    loop.compensator.drive = drive;
    loop.bypass = false;
    loop.image_whole = true;
}

static bool taken_over(const loop_parameters_t *next) {
    if (!loop.image_whole && loop.power.state == POWER_OFF) {
        begin_anew(next);
        return true;
    }
    return !loop.bypass && hyst_compensator_adopt(&loop.active->compensator, &next->compensator, &loop.compensator);
}

/* Whether nothing is pending any more. */
static bool adopt_pending(void) {
    loop_parameters_t *next = atomic_load_explicit(&loop.pending, memory_order_acquire);
    if (next == NULL) {
        return true;
    }
    if (!taken_over(next)) {
        return false;
    }
    loop.active = next;
    board_keep_park(loop_park_code());
    atomic_store_explicit(&loop.pending, NULL, memory_order_release);
    return true;
}

/* The compensator's step, with the window of this sample for limits; `before` is the last drive. */
static HYST_WITHIN hyst_q31_t step_within_window(hyst_mode_t mode, hyst_q31_t reference, hyst_q31_t before,
                                                 unsigned *events) {
    const loop_parameters_t *p = loop.active;
    const drive_window_t window = drive_window(&p->range, before);
    const hyst_q31_t drive = hyst_compensator_step_within(&p->compensator, &loop.compensator, mode, reference,
                                                          window.low, window.high, events);
    const bool limited = (*events & HYST_STEP_DRIVE_LIMITED) != 0;
    if (limited && drive != p->range.low && drive != p->range.high) {
        *events = (*events & ~(unsigned)HYST_STEP_DRIVE_LIMITED) | SLEW_LIMITED;
    }
    return drive;
}

/* After an overload, or with a damaged image: nothing that depends on a model. */
static hyst_q31_t ramp_to_park(unsigned *events) {
    const drive_range_t *range = &loop.active->range;
    *events = MEMORY_LOST;
    loop.compensator.drive = source_approach(loop.compensator.drive, range->park, range->return_slew);
    return loop.compensator.drive;
}

/* The values that belong to this position, which it returns. */
static inline past_t account(uint16_t position_code, hyst_q31_t reference, hyst_q31_t drive, unsigned events) {
    telemetry_t *t = &loop.telemetry;
    past_t *const now = &loop_past[t->sequence % HISTORY];
    now->reference = reference;
    now->drive = drive;
    const uint32_t shown = t->sequence - board_info.latency_samples;
    const past_t aligned = {.reference = loop_past[(shown - loop.active->lookahead_samples) % HISTORY].reference,
                            .drive = loop_past[shown % HISTORY].drive};
    t->reference = aligned.reference;
    t->drive = aligned.drive;
    t->position = from_code(position_code);
    t->limits_live = events;
    count_one(&loop_limits.samples[events]);
    return aligned;
}

static inline void capture_aligned(uint16_t position_code, past_t aligned) {
    uint16_t signals;
    uint16_t *to = capture_due(&signals);
    if (to != NULL) {
        if (signals == CAPTURE_DEFAULT_SIGNALS) { /* as below, and sooner */
            *to++ = (uint16_t)loop_to_code(aligned.reference, 16);
            *to++ = (uint16_t)loop_to_code(aligned.drive, board_info.drive_bits);
            *to++ = (uint16_t)(position_code ^ BOARD_CODE_MIDDLE);
        } else {
            to = loop_signals(to, signals, position_code);
        }
        capture_taken(to);
    }
}

/* Compares the position with the reference, which is the model's prediction of it as long as the drive is the model's.
 */
static inline void watch_model(uint32_t faults, unsigned events, hyst_mode_t mode) {
    const telemetry_t *t = &loop.telemetry;
    if (mode != HYST_MODE_COMPENSATE || (events & ~(unsigned)REFERENCE_LIMITED) != 0 ||
        loop.compensator.transition.size != 0 || faults != 0) {
        loop.unsettled = loop.settling;
        return;
    }
    if (loop.unsettled > 0) {
        loop.unsettled--;
        return;
    }
    loop.model_warns = model_watch_sample(t->reference, t->position);
}

/* The current into the actuator, and whether the reading can be one. */
static inline void watch_hardware(uint16_t position_code, hyst_q31_t before, hyst_q31_t drive) {
    const uint32_t step = drive > before ? (uint32_t)drive - (uint32_t)before : (uint32_t)before - (uint32_t)drive;
    loop.current += (step >> CURRENT_UNIT) - (loop.current >> CURRENT_BITS);
    if (step > (uint32_t)loop.telemetry.current_peak) {
        loop.telemetry.current_peak = (hyst_q31_t)step; /* a board allows less than full scale */
    }
    const uint32_t warnings = sensor_watch_sample(position_code, step) | health_watch_warnings() |
                              (loop.model_warns ? (uint32_t)WARNING_MODEL : 0U);
    if (warnings != loop.telemetry.warnings_live) {
        loop_report_warnings(warnings);
    }
}

/*
 * Attention. Most samples are steady ones: on, in motion as mode and source say, nothing in the input but a position,
 * no fault that comes or goes. These ask for no more than the word `attend`. Who changes any of it writes that
 * (the main loop by `take`), and the sample that finds it looks at everything, and at its end whether the next one is
 * steady again. A steady sample may adopt, too: then that is all that it does beside.
 */
static bool steady(void) {
    return loop.power.state == POWER_ON && loop.mode != HYST_MODE_PARK && loop.conditioning.leg == CONDITIONING_OFF &&
           !loop.bypass && loop.overruns_in_a_row == 0 && loop.standing_faults == loop.telemetry.faults_live;
}

static attention_t attention(void) {
    if (!steady()) {
        return ATTEND_ALL;
    }
    return atomic_load_explicit(&loop.pending, memory_order_relaxed) == NULL ? ATTEND_NOTHING : ATTEND_ADOPTION;
}

/* The end of a sample with attention, or of one in which a source ended. */
static HYST_APART void show_everything(uint32_t faults, hyst_mode_t mode) {
    loop_report(faults, mode);
    loop.attend = attention();
}

static inline hyst_q31_t steady_sample(uint16_t position_code) {
    const hyst_q31_t before = loop.compensator.drive;
    const hyst_mode_t mode = loop.mode;
    unsigned events, held_back;
    const hyst_q31_t reference = next_reference(&held_back);
    const hyst_q31_t drive = step_within_window(mode, reference, before, &events);
    events |= held_back;
    const past_t aligned = account(position_code, reference, drive, events);
    if (loop.source.playing != loop.playing) {
        show_everything(0, mode);
    }
    watch_model(0, events, mode);
    watch_hardware(position_code, before, drive);
    capture_aligned(position_code, aligned);
    return drive;
}

/* The same while parameters wait to be adopted. */
static HYST_APART hyst_q31_t adopting_sample(uint16_t position_code) {
    loop.silence++;
    if (adopt_pending()) {
        loop.attend = ATTEND_NOTHING;
    }
    return steady_sample(position_code);
}

/* Of what a steady sample does not expect, this one has nothing but an adoption. */
static bool adopts_alone(uint32_t faults) {
    return loop.attend == ATTEND_ADOPTION && faults == 0 && loop.current <= loop.current_limit &&
           loop.silence < loop.timeout;
}

/* The same with all that may happen. */
static HYST_APART hyst_q31_t look_at_everything(uint16_t position_code, uint32_t faults, uint32_t missed,
                                                uint32_t unhealthy) {
    loop_protect(faults, missed, unhealthy);
    (void)adopt_pending();
    const hyst_q31_t before = loop.compensator.drive;
    hyst_mode_t mode = loop.mode;
    hyst_q31_t reference;
    unsigned events, held_back = 0;
    if (!overruled(&mode, &reference)) {
        reference = next_reference(&held_back);
    }
    const hyst_q31_t drive = loop.bypass ? ramp_to_park(&events) : step_within_window(mode, reference, before, &events);
    events |= held_back;
    const past_t aligned = account(position_code, reference, drive, events);
    show_everything(faults, mode);
    watch_model(faults, events, mode);
    watch_hardware(position_code, before, drive);
    capture_aligned(position_code, aligned);
    return drive;
}

/*
 * Called once a sample period (100 us on the boards), which is also its deadline. Cost: docs/TIMING.md. What happens
 * when a sample comes late is the board's to say; here it is counted and reported.
 */
uint16_t loop_sample(const loop_input_t *input) {
    const uint32_t start = board_cost_counter();
    telemetry_t *t = &loop.telemetry;
    t->sequence++;
    const uint32_t silence = loop.silence + 1U;
    const uint32_t unhealthy = look_at_health();
    const bool happens =
        (loop.attend | input->faults | unhealthy) != 0 || loop.current > loop.current_limit || silence > loop.timeout;
    hyst_q31_t drive;
    if (!happens) {
        loop.silence = silence; /* a steady sample is one in motion */
        drive = steady_sample(input->position_code);
    } else if (adopts_alone(input->faults | unhealthy)) {
        drive = adopting_sample(input->position_code);
    } else {
        drive = look_at_everything(input->position_code, input->faults, input->missed, unhealthy);
    }
    t->cost_last = board_cost_counter() - start;
    if (t->cost_last > t->cost_max) {
        t->cost_max = t->cost_last;
    }
    return (uint16_t)loop_to_code(drive, board_info.drive_bits) ^ BOARD_CODE_MIDDLE;
}
