/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * A block: one physical stage of the signal chain, with its parameters and how to simulate it.
 *
 * To add an effect, add one file in blocks/ that defines `const block_t block_NAME = {`: the build finds it. Model
 * files, checks, help, simulation and the twin all work from the tables here. The test host_contract reports what is
 * missing.
 */
#ifndef BLOCK_H
#define BLOCK_H

#include "base/failure.h"
#include "chain/probe.h"
#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

/** Where in the chain a block stands, in the order of the signal. */
typedef enum { PLACE_ELECTRONICS, PLACE_HYSTERESIS, PLACE_SLOW, PLACE_MECHANICS, PLACE_SENSOR, PLACE_COUNT } place_t;

#define BLOCK_MAX_PARAMETERS 16
/** Longest array parameter. */
#define PARAMETER_MAX_ELEMENTS 4096

/** Description of a parameter. The range holds for every element of an array. */
typedef struct {
    const char *name; /**< as in the model file */
    const char *unit; /**< "V", "um", "Hz", "s", "1" ... */
    double low, high; /**< inclusive; low may be -HUGE_VAL and high HUGE_VAL */
    size_t most;      /**< elements of an array; 0: PARAMETER_MAX_ELEMENTS */
    bool array;
    bool rising;   /**< every element of the array is greater than the one before it */
    bool optional; /**< may be absent from a model */
    /** A choice (thresholds, grids, limits), a property of the drive, or an initial state, rather than a property of
     * the actuator. It does not count as a fitted parameter and gets no standard error. */
    bool chosen;
    bool proportional;    /**< the block's effect is proportional to it while it is small */
    double default_value; /**< value of an absent scalar */
    /** For a scalar that a model file may omit although it is not optional. Its value is then the middle, or half the
     * width, of this range in the model's "fit" ("drive_range_v"). NULL otherwise. */
    const char *center_of, *half_of;
    const char *text; /**< what it means */
} parameter_info_t;

/** A parameter's numbers. */
typedef struct {
    size_t count;  /**< elements; 1 for a scalar; 0 only for an absent optional array */
    double *value; /**< count elements */
    /** Standard errors, count elements, or NULL when not known. HUGE_VAL: the recordings do not determine it; 0: it is
     * on a bound, or has no separate error. */
    double *sigma;
} parameter_t;

enum { STAGE_MOST_BEFORE = 16 };

/** What a stage needs to open, besides its parameters. */
typedef struct {
    double sample_rate_hz; /**< of the simulation */
    uint64_t seed;         /**< for noise; differs from stage to stage */
    double preload_n;      /**< force on the actuator: key preload_n of the recording, 0 without */
    double clock_s;        /**< start of the recording, for free-running sources: its clock_s */
    /** The stage's input is held: between the sample before and this one it is the former's value, and this one's since
     * `held_since` parts of a sample. chain_stage_open knows what earlier stages make of it. */
    bool held;
    double held_since;
    /** Above 1, where it is not held: in so many held steps of its interpolation it goes from the sample before to this
     * one, which is read at the end of the last step. */
    size_t steps;
    /** Drives before the recording: its header key drive_before_v. The chain leads a hysteresis through them; no block
     * reads them. */
    size_t befores;
    double before_v[STAGE_MOST_BEFORE];
} stage_setup_t;

/** Number of samples that a block may look ahead. */
enum { SIGNAL_AHEAD = 2 };

/**
 * The signal between stages. `value` is in V up to the hysteresis and in um after it. A block that modifies the
 * hysteresis runs just before it: it replaces the drive of the hysteresis, or widens the loops by `slack_v`. A block
 * that follows the hysteresis runs before the next place and reads the drive of the hysteresis from `drive_v`.
 */
typedef struct {
    double value;
    /** The input at the next samples, where known, as in a recording. It improves the interpolation since the last
     * sample (smooth_drive.h). */
    size_t known_ahead;
    double ahead[SIGNAL_AHEAD];
    /** Between the last sample and this one the drive went to turn_v and back, and the hysteresis remembers it. An
     * earlier stage reports this, or the next samples show it (smooth_drive.h). */
    bool turned, turns_noted; /**< turns_noted: already determined for this sample */
    double turn_v;
    /** Lag of the hysteretic part behind the drive: plays and relays see value - slack_v, elements without width see
     * value. */
    double slack_v;
    double drive_v; /**< drive of the hysteresis at this sample; set by the chain */
} signal_t;

/** Kind of a block that is a pure lag, whose time its first parameter gives. */
typedef enum {
    LAG_NONE,     /**< no pure lag */
    LAG_LOW_PASS, /**< the parameter is the cutoff f in Hz; the lag is 1 / (2 pi f) */
    LAG_DELAY     /**< the parameter is the time in s. Its place in the chain does not matter */
} lag_t;

/** What a block does to the sensor's readings that is not a response to its input. */
typedef enum {
    READINGS_AS_THEY_ARE,
    READINGS_NOISY,  /**< adds random noise */
    READINGS_STEPPED /**< rounds them to multiples of its first parameter, in um */
} readings_t;

/** The operators of which a hysteresis is a sum, and the parameters that hold them. */
typedef enum {
    OPERATORS_OTHER,
    OPERATORS_PLAYS, /**< `weights`, `thresholds_v`, `initial_memory_v`: plays of the drive (play_curve.h) */
    OPERATORS_RELAYS /**< `levels_v`, `everett_um`, `past_v`: a plane of relays (preisach_grid.h) */
} operators_t;

struct compile_job;

typedef struct block {
    const char *name; /**< as in the model file */
    place_t place;
    unsigned order; /**< position in the catalogue among the blocks of its place; multiples of ten leave room for later
                       ones */
    bool modifies_hysteresis; /**< see signal_t; works only in a chain with a hysteresis block */
    bool follows_hysteresis;  /**< likewise */
    bool widens;              /**< writes signal_t.slack_v, by the drive that the hysteresis sees */
    bool can_widen;           /**< a hysteresis that reads slack_v, which `widens` requires */
    bool adds;                /**< its output is not a linear response to its input (noise, hum, steps, a curve) */
    const char *text;         /**< one line: what it is */
    /* Traits, so that code for any chain need not look for blocks by name. */
    lag_t lag;
    bool smooths;     /**< what comes in held goes out smooth between samples */
    const char *twin; /**< name of the block with the same effect on the other side of the voltage; NULL: none */
    readings_t readings;
    operators_t operators;
    bool own_clock;           /**< it runs freely between recordings, by stage_setup_t.clock_s */
    bool follows_temperature; /**< a temperature effect: correlation with a measured temperature is evidence for it */
    const parameter_info_t *parameter;
    size_t parameters;

    /** Checks what the ranges alone cannot (lengths, order), or NULL. `parameter` is in the order of the table. */
    bool (*check)(const parameter_t *parameter, failure_t *failure);
    /** Whether these values hold only at the model's sample rate; the chain then refuses any other. NULL: they do
     * not. */
    bool (*one_sample_rate)(const parameter_t *parameter);
    /** Bytes of state, and additional ones that depend on the parameters (NULL: none). The state is aligned like
     * malloc's and zeroed before `open`. */
    size_t state_bytes;
    size_t (*further_bytes)(const parameter_t *parameter, const stage_setup_t *setup);
    void (*open)(void *state, const parameter_t *parameter, const stage_setup_t *setup);
    /** Goes to the steady state for this constant input, and replaces *signal by the output. */
    void (*settle)(void *state, signal_t *signal);
    /** One sample: replaces *signal by the output. */
    void (*step)(void *state, signal_t *signal);
    /** Of a hysteresis: moves through a drive between two samples; called before `step`. NULL: it uses samples only. */
    void (*pass)(void *state, double drive_v);
    /** Puts the block's inverse into the amplifier's parameters (compile_job.h). A block without it is left out of the
     * inverse, and `uncorrected` says why: exactly one of the two is given. */
    bool (*compile)(struct compile_job *job, const parameter_t *parameter);
    const char *uncorrected; /**< the reason, and its effect on the position; a clause without a full stop */
    /** How diagnose searches for it; NULL: it is not a candidate. */
    const probe_t *probe;
    /** Of a block that is no physical effect but describes what none explains: how it is fitted then
     * (diagnosis/review/empirical.h). Such a block has no `probe`: it is no name. NULL: it is a physical effect. */
    const probe_t *empirical;
} block_t;

/** Records that the drive was at way_v between two samples, if that is outside both. */
static inline void signal_turns(signal_t *signal, double before_v, double way_v) {
    signal->turned = way_v > fmax(before_v, signal->value) || way_v < fmin(before_v, signal->value);
    signal->turn_v = way_v;
}

/** Checks the parameters of a bank of operators: weights (one more than operators), thresholds (one each) and initial
 * memory (one each, or none), in this order. */
bool check_operators(const parameter_t bank[3], failure_t *failure);

/** Whether it is a hysteresis proper, of which a chain has exactly one. */
static inline bool block_is_hysteresis(const block_t *block) {
    return block->place == PLACE_HYSTERESIS && !block->modifies_hysteresis && !block->follows_hysteresis;
}

/** How the numbers of a block are searched, whatever it is looked for as. NULL: they are not. */
static inline const probe_t *block_search(const block_t *block) {
    return block->probe != NULL ? block->probe : block->empirical;
}

/** Whether two blocks that diagnose looks for are hard to tell apart from position alone (probe_t.group). */
static inline bool block_same_group(const block_t *one, const block_t *other) {
    return strcmp(one->probe->group, other->probe->group) == 0;
}

/** The zeroed and opened state of a stage, to be freed by the caller. */
void *block_open(const block_t *block, const parameter_t *parameter, const stage_setup_t *setup);

#endif
