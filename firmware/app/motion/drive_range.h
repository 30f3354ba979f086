/* SPDX-License-Identifier: MIT */
/**
 * Where the drive may be, and how fast it may get there.
 *
 * The range comes with an image, the largest step with the board; registers narrow both. Together they are the window
 * of one sample, which the compensator takes for the limits of the drive: so the memory of its hysteresis advances with
 * the drive that leaves the amplifier, whatever was requested.
 *
 * May be called from: the sample interrupt.
 */
#ifndef DRIVE_RANGE_H
#define DRIVE_RANGE_H

#include "hyst/fixed.h"

typedef struct {
    hyst_q31_t low, high;   /**< low < high */
    hyst_q31_t park;        /**< within them */
    hyst_q31_t return_slew; /**< > 0: how fast a drive that is outside comes back, per sample */
    hyst_q31_t slew;        /**< > 0: the largest step of one that is within */
} drive_range_t;

typedef struct {
    hyst_q31_t low, high; /**< low <= high */
} drive_window_t;

/**
 * The window of the sample after the one whose drive was `last`: the range, as far as its slew reaches. Outside
 * of the range, as after an image with new limits, it is the one value that return_slew leads to. It is never empty,
 * and nothing in it is farther from `last` than the larger of the two slews.
 */
static inline drive_window_t drive_window(const drive_range_t *range, hyst_q31_t last);

/** The same where `last` is outside of the range. */
drive_window_t drive_window_outside(const drive_range_t *range, hyst_q31_t last);

static inline drive_window_t drive_window(const drive_range_t *range, hyst_q31_t last) {
    const hyst_q31_t low = range->low;
    const hyst_q31_t high = range->high;
    if (last > high || last < low) {
        return drive_window_outside(range, last);
    }
    const hyst_q31_t down = hyst_subtract(last, range->slew);
    const hyst_q31_t up = hyst_add(last, range->slew);
    return (drive_window_t){.low = down > low ? down : low, .high = up < high ? up : high};
}

#endif
