/* SPDX-License-Identifier: MIT */
/**
 * What the files of the loop share, and no other file includes: its state, and the few steps that more than one of them
 * needs.
 *
 * loop.c has the sample, from what the converters delivered to the drive's code. loop_protection.c has what trips, and
 * what stops motion. loop_report.c has what a sample tells: states, faults, the signals of a capture.
 * loop_control.c is the main loop's side: modes, arming, limits, new parameters.
 */
#ifndef LOOP_MEMORY_H
#define LOOP_MEMORY_H

#include "loop/loop.h"
#include "motion/conditioning.h"
#include <stdatomic.h>

/* Past samples, for the alignment. A power of two above the longest delay. */
#define HISTORY 128U
_Static_assert(HISTORY > BOARD_LATENCY_MAX + HYST_LOOKAHEAD_MAX, "history covers the longest delay");

typedef struct {
    hyst_q31_t reference;
    hyst_q31_t drive;
} past_t;

/* What the next sample has to look at beyond the input: bits. */
typedef enum {
    ATTEND_NOTHING = 0,
    ATTEND_ADOPTION = 1, /* parameters wait to be adopted */
    ATTEND_ALL = 2       /* something changed: at everything again */
} attention_t;

/*
 * Owned by the sample interrupt once it runs. The main loop touches it under board_lock, for a bounded few words at a
 * time, and hands parameters over by the pointer `pending`.
 */
typedef struct {
    loop_parameters_t *active;
    loop_parameters_t *_Atomic pending;
    uint32_t attend; /* attention_t */
    hyst_mode_t mode;
    source_t source;
    reference_limit_t limit; /* of the reference */
    hyst_q31_t reference;    /* that came out of it last */
    conditioning_t conditioning;
    hyst_q31_t conditioning_rate;
    uint32_t standing_faults; /* live until something ends them */
    power_state_t power;
    bool image_whole; /* in force: as committed, as far as is known */
    bool storing;     /* the flash is being written, which stalls the interrupt */
    bool bypass;      /* after an overload or with a damaged image: a plain ramp in place of the compensator */
    uint32_t overruns_in_a_row;
    uint32_t silence, timeout;  /* periods since a master was heard, and more than how many trip */
    uint32_t missed;            /* periods without a sample, since the start */
    uint32_t feeds, feeds_most; /* samples in which a fault's ramp still feeds the hardware watchdog, and at a trip */
    bool playing;               /* as telemetry's states have it */
    uint32_t unsettled;         /* samples until the model is watched again */
    uint32_t current;           /* average of the steps' magnitude, in 2^-21 of the range, times CURRENT_SAMPLES */
    uint32_t current_limit;     /* the same; UINT32_MAX is none */
    bool model_warns;
    uint32_t settling; /* how many that are after a sample that is not watched */
    telemetry_t telemetry;
    hyst_compensator_state_t compensator; /* it is large, and what is near the start is cheaper to get at */
    hyst_q31_t drive_low, drive_high;     /* the registers' output range, to which an image's is cut */
    hyst_q31_t drive_slew;                /* the registers' largest step, to which everything is */
    bool setpoint_given;                  /* main loop only: since the output was last parked by a command */
    bool settles;                         /* main loop only: a mode was taken before the output rested */
} loop_memory_t;

extern loop_memory_t loop;
extern past_t loop_past[HISTORY]; /* by sequence number */
extern limit_counts_t loop_limits;

/* More events beside the HYST_STEP_ ones. All are the bits of limits_live, and the events of a sample a set of them. */
enum { SLEW_LIMITED = LIMIT_SLEW, MEMORY_LOST = LIMIT_MEMORY, REFERENCE_LIMITED = LIMIT_REFERENCE };
_Static_assert((int)HYST_STEP_DRIVE_LIMITED == (int)LIMIT_DRIVE, "an event is its limit");
_Static_assert((int)HYST_STEP_UNREACHABLE == (int)LIMIT_UNREACHABLE, "an event is its limit");
_Static_assert((int)HYST_STEP_FILTER_SATURATED == (int)LIMIT_FILTER, "an event is its limit");
_Static_assert(((int)HYST_STEP_DRIVE_LIMITED | (int)HYST_STEP_UNREACHABLE | (int)HYST_STEP_FILTER_SATURATED |
                SLEW_LIMITED | MEMORY_LOST | REFERENCE_LIMITED) < (int)LIMIT_SETS,
               "the events of a sample are one of the sets");

/* Faults that trip. The others are only reported: the loop needs neither a punctual clock nor the position. */
#define TRIPS                                                                                                          \
    ((uint32_t)(FAULT_WATCHDOG | FAULT_OVERLOAD | FAULT_SUPPLY | FAULT_CURRENT | FAULT_TEMPERATURE |                   \
                FAULT_HIGH_VOLTAGE | FAULT_IMAGE | FAULT_STALL | FAULT_OUTPUT))

/* The average current is over 2^13 samples: 0.8 s at 10 kHz, in which a power stage warms up little. A step is below
 * 2^32, so in units of 2^11 below 2^21; no board's is above an eighth of that, and the sum stays below 2^32. */
#define CURRENT_BITS 13U
#define CURRENT_UNIT 11U

/* Shared steps. Sample interrupt, or main loop under board_lock. */

/* Saturates. */
static inline void count_one(uint32_t *counter) {
    const uint32_t next = *counter + 1U;
    if (next != 0) {
        *counter = next;
    }
}

static inline void count(uint32_t *counter, bool happened) {
    if (happened) {
        count_one(counter);
    }
}

/* The nearest code of `bits` bits, 16 or less, left-aligned, as a signed number: value = code / 2^15. */
static inline int16_t loop_to_code(hyst_q31_t value, unsigned bits) {
    const uint32_t half = UINT32_C(1) << (31U - bits);
    /* Saturated: what would round up beyond the range stays the largest code. */
    const uint32_t rounded = (uint32_t)hyst_add(value, (int32_t)half) & ~(2U * half - 1U);
    return (int16_t)(uint16_t)(rounded >> 16);
}

/* The code of these parameters' parking drive, as the converter has it. */
static inline uint16_t loop_park_code_of(const loop_parameters_t *parameters) {
    return (uint16_t)loop_to_code(parameters->range.park, board_info.drive_bits) ^ BOARD_CODE_MIDDLE;
}

static inline uint32_t loop_samples_in(uint32_t milliseconds) {
    return (uint32_t)((uint64_t)milliseconds * board_info.sample_rate_mhz / 1000000U);
}

/* How many samples ago the reference entered that belongs to this position. */
static inline uint32_t loop_alignment_of_reference(void) {
    return board_info.latency_samples + loop.active->lookahead_samples;
}

/** Holds the reference, which may not be where the source was. */
void loop_stop_source(void);
/** The same, and conditioning ends where it is. */
void loop_stop_motion(void);
/** The same, and the mode is park. */
void loop_to_park(void);

/** The protections of a sample, before anything is computed: trips on what the board says (loop_input_t), on what is
 * unhealthy and on what it finds itself, and switches the stage. Sample interrupt. */
void loop_protect(uint32_t board_faults, uint32_t missed, uint32_t unhealthy);

/** These faults are live. */
void loop_note_faults(uint32_t faults);

/** Faults that the board saw, and states, of this sample. Sample interrupt. */
void loop_report(uint32_t faults, hyst_mode_t mode);
/** These warnings are live. */
void loop_report_warnings(uint32_t warnings);
/** The chosen signals of a frame. Returns where the next one goes. */
uint16_t *loop_signals(uint16_t *to, uint16_t signals, uint16_t position_code);

#endif
