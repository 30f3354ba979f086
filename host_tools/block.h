/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * A block: one physical stage of the signal chain, with its parameters and how to simulate it.
 *
 * Adding an effect is one file in blocks/ that defines a block_t, and one line in BLOCKS of catalogue.h. Everything
 * else (reading and checking the model file, the help, simulation, the twin) works from the tables here.
 */
#ifndef BLOCK_H
#define BLOCK_H

#include "failure.h"
#include "probe.h"
#include <math.h>
#include <stddef.h>
#include <stdint.h>

/** Where in the chain a block stands, in the order of the signal. */
typedef enum { PLACE_ELECTRONICS, PLACE_HYSTERESIS, PLACE_SLOW, PLACE_MECHANICS, PLACE_SENSOR, PLACE_COUNT } place_t;

#define BLOCK_MAX_PARAMETERS 16
/** Longest array parameter. */
#define PARAMETER_MAX_ELEMENTS 4096

/** What is known about a parameter before it has a value. Every element of an array parameter obeys the range. */
typedef struct {
    const char *name; /**< as in the model file */
    const char *unit; /**< "V", "um", "Hz", "s", "1" ... */
    double low, high; /**< inclusive; low may be -HUGE_VAL and high HUGE_VAL */
    size_t most;      /**< elements of an array; 0: PARAMETER_MAX_ELEMENTS */
    bool array;
    bool rising;   /**< every element of the array is greater than the one before it */
    bool optional; /**< may be absent from a model */
    /** A choice (thresholds, grids, limits), a property of the drive, or a state at the start, rather than a property
     * of the actuator: it is not counted among the numbers that a fit has found, and gets no standard error. */
    bool chosen;
    bool proportional;    /**< as long as it is small, what the block does is proportional to it */
    double default_value; /**< of an absent scalar */
    /** Of a scalar that a model file may leave out although it is not optional: it is then the middle, or half the
     * width, of this range of the model's "fit" ("drive_range_v"). NULL otherwise. */
    const char *center_of, *half_of;
    const char *text; /**< what it means */
} parameter_info_t;

/** A parameter's numbers. */
typedef struct {
    size_t count;  /**< elements; 1 for a scalar; 0 only for an absent optional array */
    double *value; /**< count elements */
    /** Standard errors, count elements, or NULL when not known. HUGE_VAL: the recordings do not determine it; 0: it
     * rests on a bound, or has no error of its own. */
    double *sigma;
} parameter_t;

/** What a stage is opened with, besides its parameters. */
typedef struct {
    double sample_rate_hz; /**< of the simulation */
    uint64_t seed;         /**< for noise; differs from stage to stage */
    double preload_n;      /**< force on the actuator: key preload_n of the recording, 0 without */
    double clock_s;        /**< when the recording begins, for what runs freely: clock_s of the recording */
} stage_setup_t;

/** Samples that a block may look ahead. */
enum { SIGNAL_AHEAD = 2 };

/**
 * What travels down the chain. `value` is V up to the hysteresis and um behind it. A block that modifies the hysteresis
 * stands just before it: it replaces the drive that the hysteresis sees, or leaves it alone and widens the loops by
 * `slack_v`. One that follows it stands between it and the next place, and finds the drive that the hysteresis saw in
 * `drive_v`.
 */
typedef struct {
    double value;
    /** What comes in at the next samples, as far as that is known: in a recording. What a signal did since the last
     * sample is then known better (smooth_drive.h). */
    size_t known_ahead;
    double ahead[SIGNAL_AHEAD];
    /** On its way from the last sample to this one the drive went to turn_v and back: what is before the hysteresis
     * says so, or what comes next shows it (smooth_drive.h), and the hysteresis remembers it. */
    bool turned, turns_noted; /**< turns_noted: the chain knows that already of this sample */
    double turn_v;
    /** By how much what is hysteretic is behind the drive: plays and relays see value - slack_v, what has no width sees
     * value. */
    double slack_v;
    double drive_v; /**< what the hysteresis saw at this sample; the chain sets it */
} signal_t;

struct compile_job;

typedef struct block {
    const char *name; /**< as in the model file */
    place_t place;
    bool modifies_hysteresis; /**< see signal_t; works only in a chain with a hysteresis block */
    bool follows_hysteresis;  /**< likewise */
    bool widens;              /**< writes signal_t.slack_v, by the drive that the hysteresis sees */
    bool can_widen;           /**< a hysteresis that takes slack_v: what `widens` needs */
    bool adds; /**< what it does is no response to its input (noise, hum), or not a linear one (steps, a curve) */
    const char *text; /**< one line: what it is */
    const parameter_info_t *parameter;
    size_t parameters;

    /** Checks what the ranges alone cannot (lengths, order), or NULL. `parameter` is in the order of the table. */
    bool (*check)(const parameter_t *parameter, failure_t *failure);
    /** Whether these numbers belong to the model's sample rate: at another one the chain is refused. NULL: they do not.
     */
    bool (*one_sample_rate)(const parameter_t *parameter);
    /** Bytes of state, and further ones that depend on the parameters (NULL: none). The state is aligned like malloc's
     * and zeroed before `open`. */
    size_t state_bytes;
    size_t (*further_bytes)(const parameter_t *parameter, const stage_setup_t *setup);
    void (*open)(void *state, const parameter_t *parameter, const stage_setup_t *setup);
    /** Goes to the state in which this input has been present for ever, and replaces *signal by the output. */
    void (*settle)(void *state, signal_t *signal);
    /** One sample: replaces *signal by the output. */
    void (*step)(void *state, signal_t *signal);
    /** Of a hysteresis: passes through a drive between two samples; before `step`. NULL: it knows samples only. */
    void (*pass)(void *state, double drive_v);
    /** Puts the block's inverse into the amplifier's parameters (compile_job.h). A block without it is left out of the
     * inverse, and `uncorrected` says why: exactly one of the two is given. */
    bool (*compile)(struct compile_job *job, const parameter_t *parameter);
    const char *uncorrected; /**< what stands in the way, and what follows for the position; a clause, no full stop */
    /** How diagnose looks for it, or NULL: it is no candidate. */
    const probe_t *probe;
} block_t;

/** Says that the drive has been at way_v between two samples, if that is beyond both. */
static inline void signal_turns(signal_t *signal, double before_v, double way_v) {
    signal->turned = way_v > fmax(before_v, signal->value) || way_v < fmin(before_v, signal->value);
    signal->turn_v = way_v;
}

/** For the check of a bank of operators: parameters weights (one more than operators), thresholds (one each) and
 * initial memory (one each, or none), in this order. */
bool check_operators(const parameter_t bank[3], failure_t *failure);

/** Whether it is the hysteresis itself, of which a chain has one. */
static inline bool block_is_hysteresis(const block_t *block) {
    return block->place == PLACE_HYSTERESIS && !block->modifies_hysteresis && !block->follows_hysteresis;
}

/** The zeroed and opened state of a stage, to be freed by the caller. */
void *block_open(const block_t *block, const parameter_t *parameter, const stage_setup_t *setup);

#endif
