/* SPDX-License-Identifier: GPL-3.0-or-later */
/** What is known of a drive: drive.h finds it, and period.h its repetition. */
#ifndef LOOK_DRIVE_LOOK_H
#define LOOK_DRIVE_LOOK_H

#include "look/signal/numbers.h"
#include "recording/recording.h"

typedef enum {
    DRIVE_RESTS,    /**< it never moves */
    DRIVE_STEPS,    /**< jumps and rests */
    DRIVE_SINE,     /**< one frequency, one amplitude */
    DRIVE_SWELLING, /**< one frequency, an amplitude or a mean that changes */
    DRIVE_TRIANGLE, /**< straight lines between turning points, repeated */
    DRIVE_LINES,    /**< straight lines, not repeated */
    DRIVE_PERIODIC, /**< repeated, several frequencies */
    DRIVE_SWEEP,    /**< a frequency that runs one way */
    DRIVE_RANDOM    /**< many frequencies, nothing repeated */
} drive_kind_t;

typedef struct {
    drive_kind_t kind;
    double range_v[2];
    double step_v;  /**< all values are multiples of it beside a constant; 0: no such step seen */
    double noise_v; /**< deviation of white noise on the column; 0: none beyond its resolution */
    drive_between_t between;
    bool between_given;  /**< by the header key */
    size_t held_samples; /**< a new value comes every so many samples; 1: with each */
    size_t rests;
    look_span_t *rest;
    double rest_s; /**< all of them */
    size_t steps;
    size_t *step;           /**< first sample behind each */
    size_t levels;          /**< different values at rest */
    double period;          /**< samples, a fraction included; 0: nothing repeated */
    look_span_t repeat;     /**< where it repeats itself: two periods or more */
    double harmonics;       /**< how many lines share the power of a period: 1 for a sine (inverse participation) */
    double frequency_hz[2]; /**< 5 and 95 % of the drive's power are below these, the mean taken off */
} drive_look_t;

#endif
