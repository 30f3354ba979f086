/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * How diagnose (diagnosis/diagnose.h) searches for a block.
 */
#ifndef PROBE_H
#define PROBE_H

#include <stdbool.h>
#include <stddef.h>

/** Where a drive goes one path over and over: samples [from, to), in `period` samples, a fraction included. */
typedef struct {
    size_t from, to;
    double period; /**< 0: it does not */
} probe_passes_t;

/**
 * What a look at the recordings measured without any model, as plain numbers. A block's own file may begin its search
 * there (probe_t.from_look): a strong effect then cannot be missed. 0: nothing of the kind was seen.
 */
typedef struct {
    size_t rings;            /**< steps of the drive after which it rings with one frequency, of one recording */
    const size_t *ring_step; /**< the first sample behind each of them; the caller's */
    size_t ring_recording;   /**< which recording it is */
    double ring_hz;          /**< undamped frequency */
    double ring_damping;
    double ring_um;             /**< amplitude right behind the strongest of these steps */
    double ring_near;           /**< so near, as a logarithm, a frequency is the same */
    double peak_hz;             /**< highest maximum of the frequency response beyond its low end */
    double creep_per_decade;    /**< in holds, of the change before them */
    bool rails;                 /**< the position stops while the drive goes on */
    double rail_v[2];           /**< below and above these; where only one was seen, the other is beyond the drive */
    double added_noise_percent; /**< of the stroke, that was added to readings that had none; 0: none was */
    bool rests, repeats;        /**< what is noise shows where the drive rests; between passes of a path that repeats */
    const probe_passes_t *passes; /**< of each recording; the caller's. NULL: not known */
    double drive_step_v;          /**< values of the drive were rounded to multiples of it; 0: none shows */
} probe_seen_t;

/** Properties of the recordings, from which initial values are chosen. */
typedef struct {
    probe_seen_t seen;
    double drive_low_v, drive_high_v, largest_rate_v_per_s;
    double displacement_low_um, displacement_high_um;
    double sample_rate_hz, longest_s; /**< longest recording */
    double held_s, held_since_s; /**< how long the drive is held, 0: it is not; and how long it was when it was read */
    bool preloads;               /**< the recordings differ in their preload */
    /** Of the recordings whose drive goes beyond the supply that was measured of the stage, the least supply; 0: of
     * none. */
    double short_supply_v;
    size_t lines; /**< frequencies at which the residual has a narrow peak */
    const double *line_hz;
    size_t harmonic; /**< that these lines are taken for, of something periodic; 0: the first */
    bool strong;     /**< an effect of many times the noise is looked for: starting points that only it is worth, too */
    /** A finding in whose place a richer form of it is tried (probe_t.in_place_of), and its numbers; NULL: none. */
    const struct block *replaced;
    const double *replaced_value;
} probe_setting_t;

/**
 * What `record --probe` plays to reveal a block and to distinguish it from others (probe_plan.h), as bits. A sweep of
 * the whole range and a slow decaying triangle always come first: they identify the hysteresis.
 */
enum {
    PROBE_SILENCE = 1U << 0,       /**< two levels, held */
    PROBE_STAIRCASE = 1U << 1,     /**< steps up and down that return to the same levels, with long holds */
    PROBE_FAST_TRIANGLE = 1U << 2, /**< the decaying triangle, faster */
    PROBE_CHIRPS = 1U << 3,        /**< rising frequency, at a small and at a larger amplitude */
    PROBE_BURST = 1U << 4,         /**< fast and large for a while, then a pause */
    PROBE_LADDER = 1U << 5,        /**< loops whose ends come closer to those of the range */
    PROBE_LOOPS = 1U << 6,         /**< equal small loops at several levels */
    PROBE_RETURN = 1U << 7,        /**< the slow decaying triangle once more, at the end */
    PROBE_EVERYTHING = (1U << 8) - 1U
};

typedef struct {
    /** Effects that are hard to distinguish from position alone share a group: "lag", "slow" ..; a unique name
     * otherwise. */
    const char *group;
    /** Groups whose findings this block, a richer form of them, may take the place of where these leave more than
     * noise: with one number more it is as good as they are in their place, and says no more. By itself it is looked
     * for only where structure is left in the end, and found only if it explains all of it. All NULL: it is looked for
     * by itself. */
    const char *in_place_of[2];
    /** With some numbers it is what they are: a smaller gain shows that it is more than that. */
    bool extends;
    /** Then: index of the parameter, a part of 1, that is 0 or 1 where it is what they are. */
    size_t extends_by;
    /** One or two plain sentences: what it is and how it shows. */
    const char *explanation;
    /** What to record to detect it, or to distinguish it within its group. */
    const char *excitation;
    /** The parts of a probe that excite it: one or more PROBE_ bits. */
    unsigned parts;
    /** A rate-independent hysteresis of another shape can imitate it, so it is searched for only with the model's
     * hysteresis kept. */
    bool shape;
    /**
     * Sets `value`, one number per parameter (arrays stay absent), to small or typical values of the block, number
     * `index` of several starting points. false: there is none.
     */
    bool (*probe)(const probe_setting_t *setting, size_t index, double *value);
    /** The same from what a look has seen, tried before these; NULL: nothing that a look sees says anything of it. */
    bool (*from_look)(const probe_seen_t *seen, size_t index, double *value);
    /** It rings after a step: one parameter is its frequency, and these numbers may be what a look has seen ring. NULL:
     * it does not. */
    bool (*rings)(const probe_seen_t *seen, const double *value);
    /** Why there may be no starting point, a clause: what the recordings lack. NULL: there always is one. */
    const char *absent;
    /** The parameters that are then optimised, as bits: 1 << index. */
    unsigned searched;
    /** Numbers that stay at their defaults while the block is looked for, as bits; an array is of one number, or
     * absent. A finding of it is given those that are worth their price (joined.h), and from then on they are searched,
     * too. */
    unsigned joins;
    /** What such a number begins with, beside the block's others, one number per parameter. */
    double (*join)(const probe_setting_t *setting, const double *value, size_t parameter);
    /** Those that are never negative in an actuator, though a model may allow it, as bits. */
    unsigned positive;
    /** Upper bound of the search, by index; 0: that of the parameter's range. */
    double most[5];
    /** Relative error of each estimate due to approximations in the block, by index; 0: that of the first. Included in
     * the standard errors. */
    double accuracy[5];
    /** The block's output has corners that move from sample to sample with its parameters. The cost then has small
     * local minima beside the global one. */
    bool corners;
    /**
     * Name of another block whose initial transient resembles this block while this one is small: while its parameter
     * `size_um` is below the other's parameter `part_of_range` times the range of the displacement. A finding of this
     * block may then be the other one. All NULL: none.
     */
    struct {
        const char *beside, *size_um, *part_of_range;
    } doubtful;
    /**
     * Of a relaxation; all NULL: it is none. Names of its parameters that are the first and the last time in which it
     * acts: a recording shows them from two samples to its length. Then two blocks. The first imitates it where it
     * begins as fast as can be seen, the second where the recording shows hardly any of it.
     */
    struct {
        const char *from_s, *to_s, *faster, *slower;
    } times;
    /** Names of two blocks that together have nearly the effect of this one; NULL: none. This one is preferred only if
     * it explains as much as they do. */
    const char *together[2];
} probe_t;

/** Whether a block with this probe (NULL: none) is looked for by itself. */
static inline bool probe_is_first(const probe_t *probe) {
    return probe != NULL && probe->in_place_of[0] == NULL;
}

/** Whether a block with this probe is a richer form of the findings of a group. */
bool probe_may_replace(const probe_t *probe, const char *group);

/** Whether something at this frequency is what a look has seen ring. */
bool probe_saw_ring(const probe_seen_t *seen, double frequency_hz);

/** The middle and half the width of a range. */
static inline void probe_range(double low, double high, double *center, double *half_range) {
    *center = 0.5 * (high + low);
    *half_range = 0.5 * (high - low);
}

/** A level among those of the displacement: what a slow block may begin with (probe_t.join). */
double probe_join_level(const probe_setting_t *setting, const double *value, size_t parameter);

/** low * (high / low)^(index / (count - 1)), 0 <= index < count; false for a larger index. */
bool probe_between(double low, double high, size_t count, size_t index, double *value);

#endif
