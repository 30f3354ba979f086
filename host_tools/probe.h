/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * How a block is looked for: what diagnose (diagnosis/diagnose.h) has to know of it besides how it simulates.
 */
#ifndef PROBE_H
#define PROBE_H

#include <stdbool.h>
#include <stddef.h>

/** What the recordings are like, for choosing where to look. */
typedef struct {
    double drive_low_v, drive_high_v, largest_rate_v_per_s;
    double displacement_low_um, displacement_high_um;
    double sample_rate_hz, longest_s; /**< longest recording */
    bool preloads;                    /**< the recordings differ in their preload */
    size_t lines;                     /**< frequencies at which the residual has a narrow peak */
    const double *line_hz;
} probe_setting_t;

/**
 * What `record --probe` plays to reveal a block and to tell it from others (probe_plan.h), as bits. A sweep of the
 * whole range and a slow decaying triangle come first in any case: without them there is no hysteresis to compare with.
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
    /** Effects that position alone hardly tells apart share a group: "lag", "slow" ..; a name of its own otherwise. */
    const char *group;
    /** One or two plain sentences: what it is and how it shows. */
    const char *explanation;
    /** What to record to see it, or to tell it from its group. */
    const char *excitation;
    /** Which parts of the excitation the amplifier can play towards that: one or more PROBE_ bits. */
    unsigned parts;
    /** A rate-independent hysteresis of another shape can imitate it, so it is looked for only against the model's own.
     */
    bool shape;
    /**
     * Sets `value`, one number a parameter (arrays stay absent), to the probe-th of some small or typical instances of
     * the block. false: there is no such.
     */
    bool (*probe)(const probe_setting_t *setting, size_t index, double *value);
    /** Why there may be none at all, a clause: what the recordings lack. NULL: there always is. */
    const char *absent;
    /** Which parameters are then searched, as bits: 1 << index. */
    unsigned searched;
    /** Which of them are never below 0 in an actuator, as bits, though a model may have them there. */
    unsigned positive;
    /** Largest value at which a parameter is searched, by index; 0: as large as it may be. */
    double most[4];
    /** How far the numbers that are found may be from the actuator's because of the block's own approximations, in
     * parts of them, by index; 0: as far as the first. Part of their standard errors. */
    double accuracy[4];
    /** What the block does has corners that move from sample to sample with its numbers: what is left then has little
     * minima beside the true one. */
    bool corners;
    /** Two blocks that together do nearly what this one does, by name; NULL: none do. It is taken only where it
     * explains as much as they do. */
    const char *together[2];
} probe_t;

/** low * (high / low)^(index / (count - 1)), 0 <= index < count: false beyond. */
bool probe_between(double low, double high, size_t count, size_t index, double *value);

#endif
