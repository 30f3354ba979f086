/* SPDX-License-Identifier: MIT */
#include "loop.h"
#include "board.h"
#include "capture.h"
#include "conditioning.h"
#include "health_watch.h"
#include "model_watch.h"
#include "sensor_watch.h"
#include <stdatomic.h>

/* Past samples, for the alignment. A power of two above the longest delay. */
#define HISTORY 128U
_Static_assert(HISTORY > BOARD_LATENCY_MAX + HYST_LOOKAHEAD_MAX, "history covers the longest delay");

typedef struct {
    hyst_q31_t reference;
    hyst_q31_t drive;
} past_t;

/*
 * Owned by the sample interrupt once it runs. The main loop touches it under board_lock, for a bounded few words at a
 * time, and hands parameters over by the pointer `pending`.
 */
static struct {
    loop_parameters_t *active;
    loop_parameters_t *_Atomic pending;
    bool attend; /* something changed: the next sample looks at everything again */
    hyst_mode_t mode;
    source_t source;
    reference_limit_t limit; /* of the reference */
    hyst_q31_t reference;    /* that came out of it last */
    conditioning_t conditioning;
    hyst_q31_t conditioning_rate;
    past_t past[HISTORY];
    uint32_t standing_faults; /* live until something ends them */
    power_state_t power;
    bool bypass; /* after an overload: a plain ramp in place of the compensator */
    uint32_t overruns_in_a_row;
    uint32_t silence, timeout; /* samples since a master was heard, and more than how many trip */
    uint32_t cost;             /* of the last sample; telemetry gets it with the next */
    bool playing;              /* as telemetry's states have it */
    uint32_t unsettled;        /* samples until the model is watched again */
    uint32_t current;          /* average of the steps' magnitude, in 2^-21 of the range, times CURRENT_SAMPLES */
    uint32_t current_limit;    /* the same; UINT32_MAX is none */
    bool model_warns;
    hyst_q31_t drive_low, drive_high; /* the registers' output range, to which an image's is cut */
    uint32_t settling;                /* how many that are after a sample that is not watched */
    telemetry_t telemetry;
    hyst_compensator_state_t compensator; /* last: it is large, and what is near the start is cheaper to get at */
} loop;

/* More events beside the HYST_STEP_ ones. All are the bits of limits_live. */
enum { SLEW_LIMITED = LIMIT_SLEW, MEMORY_LOST = LIMIT_MEMORY, REFERENCE_LIMITED = LIMIT_REFERENCE };
_Static_assert((int)HYST_STEP_DRIVE_LIMITED == (int)LIMIT_DRIVE, "an event is its limit");
_Static_assert((int)HYST_STEP_UNREACHABLE == (int)LIMIT_UNREACHABLE, "an event is its limit");
_Static_assert((int)HYST_STEP_FILTER_SATURATED == (int)LIMIT_FILTER, "an event is its limit");

/* Faults that trip. The others are only reported: the loop needs neither a punctual clock nor the position. */
#define TRIPS                                                                                                          \
    ((uint32_t)(FAULT_WATCHDOG | FAULT_OVERLOAD | FAULT_SUPPLY | FAULT_CURRENT | FAULT_TEMPERATURE |                   \
                FAULT_HIGH_VOLTAGE))

/* The average current is over 2^13 samples: 0.8 s at 10 kHz, in which a power stage warms up little. A step is below
 * 2^32, so in units of 2^11 below 2^21; no board's is above an eighth of that, and the sum stays below 2^32. */
#define CURRENT_BITS 13U
#define CURRENT_UNIT 11U

static hyst_q31_t from_code(uint16_t code) {
    return (hyst_q31_t)((uint32_t)(code ^ BOARD_CODE_MIDDLE) << 16);
}

/* The nearest code of `bits` bits, 16 or less, left-aligned, as a signed number: value = code / 2^15. */
static int16_t to_code(hyst_q31_t value, unsigned bits) {
    const uint32_t half = UINT32_C(1) << (31U - bits);
    /* Saturated: what would round up beyond the range stays the largest code. */
    const uint32_t rounded = (uint32_t)hyst_add(value, (int32_t)half) & ~(2U * half - 1U);
    return (int16_t)(uint16_t)(rounded >> 16);
}

static inline void count_one(uint32_t *counter) {
    const uint32_t next = *counter + 1U;
    if (next != 0) {
        *counter = next;
    }
}

static void count(uint32_t *counter, bool happened) {
    if (happened) {
        count_one(counter);
    }
}

/* One converter range, 2^32, per second. */
static hyst_q31_t range_per_second(void) {
    const uint64_t rate = ((uint64_t)1000U << 32) / board_info.sample_rate_mhz;
    return rate < HYST_Q31_MAX ? (hyst_q31_t)rate : HYST_Q31_MAX;
}

static uint32_t samples_in(uint32_t milliseconds) {
    return (uint32_t)((uint64_t)milliseconds * board_info.sample_rate_mhz / 1000000U);
}

/* Number of the lowest bit, counted from 1; 0 for none. */
static uint32_t first_of(uint32_t bits) {
    uint32_t number = 0;
    while (bits != 0) {
        number++;
        bits = (bits & 1U) != 0 ? 0 : bits >> 1;
    }
    return number;
}

static void note_faults(uint32_t faults) {
    telemetry_t *t = &loop.telemetry;
    if (t->faults_sticky == 0 && faults != 0) {
        t->fault_first = first_of(faults);
    }
    t->faults_live = faults;
    t->faults_sticky |= faults;
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
    loop.conditioning.leg = CONDITIONING_OFF;
    loop.conditioning_rate = range_per_second();
    const hyst_q31_t park = parameters->range.park;
    for (unsigned i = 0; i < HISTORY; i++) {
        loop.past[i].reference = 0;
        loop.past[i].drive = park;
    }
    loop.standing_faults = faults;
    power_init(&loop.power);
    loop.bypass = false;
    loop.overruns_in_a_row = 0;
    loop.silence = 0;
    loop.timeout = samples_in(LOOP_DEFAULT_TIMEOUT_MS);
    loop.cost = 0;
    loop.attend = true;
    loop.playing = false;
    loop.settling = samples_in(LOOP_SETTLING_MS) + BOARD_LATENCY_MAX + HYST_LOOKAHEAD_MAX;
    loop.unsettled = loop.settling;
    loop.current = 0;
    loop.current_limit = UINT32_MAX;
    loop.model_warns = false;
    loop.telemetry = (telemetry_t){.state = LOOP_PARKED, .drive = park};
    note_faults(faults);
    telemetry_publish(&loop.telemetry);
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

/* Holds the reference, which may not be where the source was. */
static void stop_source(void) {
    if (loop.source.playing) {
        loop.source.value = loop.reference;
        source_stop(&loop.source);
    }
}

static void stop_motion(void) {
    stop_source();
    if (loop.conditioning.leg != CONDITIONING_OFF) {
        loop.conditioning.leg = CONDITIONING_OFF;
        if (loop.mode == HYST_MODE_DIRECT) {
            loop.source.value = loop.source.setpoint = loop.reference = loop.conditioning.reference;
        }
    }
}

static void park(void) {
    stop_motion();
    loop.mode = HYST_MODE_PARK;
}

/* What is to be protected from runs: not what is parked, which a silent master may leave alone. */
static bool moving(void) {
    return loop.power.state == POWER_ON && (loop.mode != HYST_MODE_PARK || loop.conditioning.leg != CONDITIONING_OFF);
}

/* Temperature and supplies, which are not looked at in every sample: faults of this look. What is on its way off goes
 * there, and arming is refused while they last. */
static inline uint32_t unhealthy(void) {
    if (loop.telemetry.sequence % HEALTH_WATCH_EVERY != 0) {
        return 0;
    }
    const uint32_t faults = health_watch_look(loop.power.state == POWER_ON);
    return power_armed(&loop.power) ? faults : 0;
}

/* The faults of this sample that trip, beside those that are known. */
static uint32_t tripping(bool supply_low, bool overrun, uint32_t faults) {
    faults |= supply_low ? FAULT_SUPPLY : 0U;
    if (loop.current > loop.current_limit && loop.power.state == POWER_ON) {
        faults |= FAULT_CURRENT;
    }
    const bool adopting = atomic_load_explicit(&loop.pending, memory_order_relaxed) != NULL;
    loop.overruns_in_a_row = overrun && !adopting ? loop.overruns_in_a_row + 1U : 0;
    if (loop.overruns_in_a_row >= LOOP_OVERRUNS_TO_TRIP) {
        loop.overruns_in_a_row = 0;
        faults |= FAULT_OVERLOAD;
    }
    loop.silence += moving() ? 1U : 0U;
    if (loop.silence > loop.timeout) {
        loop.silence = 0;
        faults |= FAULT_WATCHDOG;
    }
    return faults;
}

/* Protections, before anything is computed. Reaction time: this sample's drive is the first of the ramp. */
static void protect(bool supply_low, bool overrun, uint32_t known_faults) {
    const bool parked = loop.compensator.drive == loop.active->range.park;
    const uint32_t faults = tripping(supply_low, overrun, known_faults);
    if (faults != 0 && ((faults & FAULT_OVERLOAD) != 0 || loop.power.state != POWER_OFF)) {
        park();
        if (loop.power.state != POWER_FAULT) {
            capture_event(CAPTURE_AT_FAULT);
        }
        power_trip(&loop.power, faults);
        loop.standing_faults |= faults;
        loop.bypass = loop.bypass || (faults & FAULT_OVERLOAD) != 0;
    }
    power_sample(&loop.power, parked);
    if (loop.bypass && loop.power.state == POWER_OFF) {
        loop.bypass = false;
        hyst_compensator_reset(&loop.active->compensator, &loop.compensator); /* as after a start */
    }
    board_stage_enable(power_stage_enabled(&loop.power, parked));
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
            *reference = conditioning_step(&loop.conditioning, range, loop.conditioning_rate);
            return true;
        }
        conditioning_ended();
    }
    return false;
}

/* The source's, within its limits. */
static inline hyst_q31_t next_reference(unsigned *events) {
    const hyst_q31_t wanted = source_step(&loop.source);
    loop.reference = reference_limited(&loop.limit, loop.reference, wanted);
    *events = loop.reference != wanted ? REFERENCE_LIMITED : 0U;
    return loop.reference;
}

static void adopt_pending(void) {
    loop_parameters_t *next = atomic_load_explicit(&loop.pending, memory_order_acquire);
    if (next != NULL && !loop.bypass &&
        hyst_compensator_adopt(&loop.active->compensator, &next->compensator, &loop.compensator)) {
        loop.active = next;
        atomic_store_explicit(&loop.pending, NULL, memory_order_release);
    }
}

/* The compensator's step, with the window of this sample for limits. */
static hyst_q31_t step_within_window(hyst_mode_t mode, hyst_q31_t reference, unsigned *events) {
    loop_parameters_t *p = loop.active;
    const drive_window_t window = drive_window(&p->range, loop.compensator.drive, board_info.drive_slew_max);
    p->compensator.drive_low = window.low;
    p->compensator.drive_high = window.high;
    const hyst_q31_t drive = hyst_compensator_step(&p->compensator, &loop.compensator, mode, reference, events);
    const bool limited = (*events & HYST_STEP_DRIVE_LIMITED) != 0;
    if (limited && drive != p->range.low && drive != p->range.high) {
        *events = (*events & ~(unsigned)HYST_STEP_DRIVE_LIMITED) | SLEW_LIMITED;
    }
    return drive;
}

/* After an overload: nothing that depends on a model. */
static hyst_q31_t ramp_to_park(unsigned *events) {
    const drive_range_t *range = &loop.active->range;
    *events = MEMORY_LOST;
    loop.compensator.drive = source_approach(loop.compensator.drive, range->park, range->return_slew);
    return loop.compensator.drive;
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

static uint32_t alignment_of_reference(void) {
    return board_info.latency_samples + loop.active->lookahead_samples;
}

/* What the limits did in this sample. */
static void account_limits(unsigned events) {
    telemetry_t *t = &loop.telemetry;
    t->limits_live = events;
    t->limits_sticky |= events;
    count(&t->drive_limited, (events & HYST_STEP_DRIVE_LIMITED) != 0);
    count(&t->unreachable, (events & HYST_STEP_UNREACHABLE) != 0);
    count(&t->filter_saturated, (events & HYST_STEP_FILTER_SATURATED) != 0);
    count(&t->slew_limited, (events & SLEW_LIMITED) != 0);
    count(&t->reference_limited, (events & REFERENCE_LIMITED) != 0);
}

/*
 * Attention. Most samples are steady ones: on, in motion as mode and source say, nothing in the input but a position,
 * nothing to adopt, no fault that comes or goes. These ask for no more than the flag `attend`. Who changes any of it
 * sets the flag (the main loop by `take`), and the sample that finds it looks at everything, and at its end whether the
 * next one is steady again.
 */
static bool steady(void) {
    return loop.power.state == POWER_ON && loop.mode != HYST_MODE_PARK && loop.conditioning.leg == CONDITIONING_OFF &&
           !loop.bypass && loop.overruns_in_a_row == 0 && loop.standing_faults == loop.telemetry.faults_live &&
           atomic_load_explicit(&loop.pending, memory_order_relaxed) == NULL;
}

/* The beginning of such a sample. */
static HYST_APART void look_at_everything(bool supply_low, bool overrun, uint32_t known_faults) {
    protect(supply_low, overrun, known_faults);
    adopt_pending();
}

/* The end of it, or of one in which a source ended: faults and states, of this sample. */
static HYST_APART void show_everything(bool supply_low, bool overrun, bool converter_timeout, hyst_mode_t mode) {
    telemetry_t *t = &loop.telemetry;
    t->active_mode = mode;
    t->state = state_of(mode);
    t->amplifier_state = amplifier_state();
    t->trip_cause = first_of(loop.power.cause);
    loop.playing = loop.source.playing;
    count(&t->overruns, overrun);
    count(&t->converter_timeouts, converter_timeout);
    const uint32_t faults = loop.standing_faults | (supply_low ? FAULT_SUPPLY : 0U) | (overrun ? FAULT_OVERRUN : 0U) |
                            (converter_timeout ? FAULT_CONVERTER_TIMEOUT : 0U);
    if (faults != t->faults_live) {
        note_faults(faults);
    }
    loop.attend = !steady();
}

/* The values that belong to this position, and what the limits did. */
static inline void account(uint16_t position_code, unsigned events) {
    telemetry_t *t = &loop.telemetry;
    const uint32_t shown = t->sequence - board_info.latency_samples;
    t->reference = loop.past[(shown - loop.active->lookahead_samples) % HISTORY].reference;
    t->drive = loop.past[shown % HISTORY].drive;
    t->position = from_code(position_code);
    count_one(&t->samples);
    if ((events | t->limits_live) != 0) {
        account_limits(events);
    }
}

static uint16_t upper(hyst_q31_t value) {
    return (uint16_t)((uint32_t)value >> 16);
}

/* The signals beside the first three. Returns where the next one goes. */
static uint16_t *further_signals(uint16_t *to, uint16_t signals) {
    const telemetry_t *t = &loop.telemetry;
    const hyst_q31_t before = loop.past[(t->sequence - board_info.latency_samples - 1U) % HISTORY].drive;
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
        *to++ = upper(hyst_saturate(loop.compensator.transition));
    }
    return to;
}

/* The chosen ones of all signals. */
static HYST_APART uint16_t *chosen_signals(uint16_t *to, uint16_t signals, uint16_t position_code) {
    const telemetry_t *t = &loop.telemetry;
    if ((signals & CAPTURE_REFERENCE) != 0) {
        *to++ = (uint16_t)to_code(t->reference, 16);
    }
    if ((signals & CAPTURE_DRIVE) != 0) {
        *to++ = (uint16_t)to_code(t->drive, board_info.drive_bits);
    }
    if ((signals & CAPTURE_POSITION) != 0) {
        *to++ = (uint16_t)(position_code ^ BOARD_CODE_MIDDLE);
    }
    return further_signals(to, signals);
}

static inline void capture_aligned(uint16_t position_code) {
    telemetry_t *t = &loop.telemetry;
    uint16_t signals;
    uint16_t *to = capture_due(&signals);
    if (to != NULL) {
        if (signals == CAPTURE_DEFAULT_SIGNALS) { /* as below, and sooner */
            *to++ = (uint16_t)to_code(t->reference, 16);
            *to++ = (uint16_t)to_code(t->drive, board_info.drive_bits);
            *to++ = (uint16_t)(position_code ^ BOARD_CODE_MIDDLE);
        } else {
            to = chosen_signals(to, signals, position_code);
        }
        capture_taken(to);
    }
    t->capture_state = capture_state();
    t->capture_frames = capture_frames();
}

static void warn(uint32_t warnings) {
    telemetry_t *t = &loop.telemetry;
    if ((warnings & ~t->warnings_live) != 0) {
        capture_event(CAPTURE_AT_WARNING);
    }
    t->warnings_live = warnings;
    t->warnings_sticky |= warnings;
}

/* Compares the position with the reference, which is the model's prediction of it as long as the drive is the model's.
 */
static inline void watch_model(bool eventful, unsigned events, hyst_mode_t mode) {
    const telemetry_t *t = &loop.telemetry;
    if (mode != HYST_MODE_COMPENSATE || (events & ~(unsigned)REFERENCE_LIMITED) != 0 ||
        loop.compensator.transition != 0 || eventful) {
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
    const uint32_t warnings = sensor_watch_sample(position_code, step) | health_watch_warnings() |
                              (loop.model_warns ? (uint32_t)WARNING_MODEL : 0U);
    if (warnings != loop.telemetry.warnings_live) {
        warn(warnings);
    }
}

/*
 * Called once a sample period (100 us on the boards), which is also its deadline. Cost: docs/TIMING.md. What happens
 * when a sample comes late is the board's to say; here it is counted and reported.
 */
uint16_t loop_sample(const loop_input_t *input) {
    const uint32_t start = board_cost_counter();
    const uint16_t position_code = input->position_code;
    telemetry_t *t = &loop.telemetry;
    t->sequence++;
    t->cost_last = loop.cost;
    if (loop.cost > t->cost_max) {
        t->cost_max = loop.cost;
    }
    const bool eventful = (input->converter_timeout | input->overrun | input->supply_low) != 0;
    const uint32_t silence = loop.silence + 1U;
    const uint32_t faults = unhealthy();
    const bool attend =
        loop.attend || eventful || faults != 0 || loop.current > loop.current_limit || silence > loop.timeout;
    if (attend) {
        look_at_everything(input->supply_low, input->overrun, faults);
    } else {
        loop.silence = silence; /* a steady sample is one in motion */
    }

    unsigned events, held_back = 0;
    const hyst_q31_t before = loop.compensator.drive;
    hyst_mode_t mode = loop.mode;
    hyst_q31_t reference;
    if (!attend || !overruled(&mode, &reference)) {
        reference = next_reference(&held_back);
    }
    const hyst_q31_t drive =
        attend && loop.bypass ? ramp_to_park(&events) : step_within_window(mode, reference, &events);
    const uint16_t code = (uint16_t)to_code(drive, board_info.drive_bits);
    events |= held_back;

    past_t *now = &loop.past[t->sequence % HISTORY];
    now->reference = reference;
    now->drive = drive;
    account(position_code, events);
    if (attend || loop.source.playing != loop.playing) {
        show_everything(input->supply_low, input->overrun, input->converter_timeout, mode);
    }
    watch_model(eventful, events, mode);
    watch_hardware(position_code, before, drive);
    capture_aligned(position_code);

    loop.cost = board_cost_counter() - start;
    return code ^ BOARD_CODE_MIDDLE;
}

/* The main loop's way to what the interrupt owns. */
static uint32_t take(void) {
    const uint32_t key = board_lock();
    loop.attend = true;
    return key;
}

static void limit_range(loop_parameters_t *parameters) {
    const drive_range_t *image = &parameters->image_range;
    parameters->range = *image;
    parameters->range.low = image->low > loop.drive_low ? image->low : loop.drive_low;
    parameters->range.high = image->high < loop.drive_high ? image->high : loop.drive_high;
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

bool loop_set_drive_limits(hyst_q31_t low, hyst_q31_t high) {
    if (!loop_drive_limits_possible(low, high)) {
        return false;
    }
    const uint32_t key = take();
    loop_parameters_t *next = atomic_load_explicit(&loop.pending, memory_order_relaxed);
    loop.drive_low = low;
    loop.drive_high = high;
    limit_range(loop.active);
    if (next != NULL) {
        limit_range(next);
    }
    board_unlock(key);
    return true;
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
    const uint32_t key = take();
    atomic_store_explicit(&loop.pending, next, memory_order_release);
    board_unlock(key);
    return true;
}

hyst_mode_t loop_mode(void) {
    return loop.mode; /* only the main loop writes it */
}

/* A fault may come between the check of a request and this: then the fault has it. */
void loop_set_mode(hyst_mode_t mode) {
    const uint32_t key = take();
    if (mode == HYST_MODE_PARK) {
        park();
    } else if (power_armed(&loop.power)) {
        if (loop.mode == HYST_MODE_PARK) {
            loop.silence = 0;
        }
        loop.mode = mode;
    }
    board_unlock(key);
}

bool loop_arm(void) {
    const uint32_t key = take();
    const bool armed = power_arm(&loop.power, samples_in(POWER_PRECHARGE_MS));
    board_unlock(key);
    return armed;
}

void loop_disarm(void) {
    const uint32_t key = take();
    park();
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
    const hyst_q31_t park = loop.active->range.park;
    board_unlock(key);
    return (uint16_t)to_code(park, board_info.drive_bits) ^ BOARD_CODE_MIDDLE;
}

uint32_t loop_samples(void) {
    return *(volatile uint32_t *)&loop.telemetry.sequence; /* one word: read whole */
}

void loop_master_heard(void) {
    *(volatile uint32_t *)&loop.silence = 0; /* one word: written whole */
}

void loop_set_timeout(uint32_t milliseconds) {
    const uint32_t key = board_lock();
    loop.timeout = milliseconds != 0 ? samples_in(milliseconds) : UINT32_MAX;
    loop.silence = 0;
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
    const uint32_t key = take();
    if (loop.power.state != POWER_ON || loop.mode == HYST_MODE_PARK) {
        board_unlock(key); /* a fault came first */
        return;
    }
    source_start(&loop.source, settings);
    if (settings->kind == SOURCE_SINE) {
        hyst_hysteresis_begin_sine(&loop.active->compensator.hysteresis, hyst_compensator_memory(&loop.compensator));
    }
    capture_source_started(alignment_of_reference());
    board_unlock(key);
}

bool loop_plays(source_kind_t kind) {
    const uint32_t key = board_lock();
    const bool playing = loop.source.playing && loop.source.settings.kind == kind;
    board_unlock(key);
    return playing;
}

bool loop_conditioning(void) {
    const uint32_t key = board_lock();
    const bool conditioning = loop.conditioning.leg != CONDITIONING_OFF;
    board_unlock(key);
    return conditioning;
}

void loop_set_current_limit(hyst_q31_t limit) {
    const uint32_t key = board_lock();
    loop.current_limit = limit > 0 ? ((uint32_t)limit >> CURRENT_UNIT) << CURRENT_BITS : UINT32_MAX;
    board_unlock(key);
}

hyst_q31_t loop_current_average(void) {
    const uint32_t units = *(volatile uint32_t *)&loop.current >> CURRENT_BITS; /* one word: read whole */
    return hyst_saturate((int64_t)units << CURRENT_UNIT);
}

uint32_t loop_trip_cause(void) {
    return *(volatile uint32_t *)&loop.power.cause;
}

uint32_t loop_warnings(void) {
    return *(volatile uint32_t *)&loop.telemetry.warnings_live;
}

void loop_set_model_limit(hyst_q31_t limit, uint32_t milliseconds) {
    const uint32_t key = board_lock();
    model_watch_set_limit(limit, samples_in(milliseconds));
    loop.model_warns = false;
    board_unlock(key);
}

void loop_stop(void) {
    const uint32_t key = take();
    stop_motion();
    if (power_leave_fault(&loop.power)) {
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
    stop_source();
    /* In direct mode a transition may still be part of the drive: go on from the reference, not from the drive. */
    conditioning_start(&loop.conditioning, loop.compensator.mode == HYST_MODE_DIRECT
                                               ? loop.past[loop.telemetry.sequence % HISTORY].reference
                                               : loop.compensator.drive);
    board_unlock(key);
}

void loop_clear(void) {
    const uint32_t key = take();
    telemetry_t *t = &loop.telemetry;
#define COUNTER(name, address, note, text) t->name = 0;
#include "registers.def"
    t->samples = 0;
    t->cost_last = t->cost_max = loop.cost = 0;
    t->faults_sticky = t->fault_first = t->limits_sticky = 0;
    t->warnings_sticky = t->warnings_live;
    model_watch_clear();
    note_faults(loop.standing_faults);
    board_unlock(key);
}
