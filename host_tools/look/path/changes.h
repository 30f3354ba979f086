/* SPDX-License-Identifier: GPL-3.0-or-later */
/** What changed for good about the readings, and when: samples that were lost or read twice, a gain or an offset that
 * was switched. look/path/changes_find.h looks for it. */
#ifndef LOOK_CHANGES_H
#define LOOK_CHANGES_H

#include "look/path/lags.h"

enum { CHANGES_MOST = 8, CHANGES_MOST_SHIFT = 12 };

typedef struct {
    size_t at;     /**< first reading behind it */
    size_t within; /**< samples to either side in which it may be */
    int samples;   /**< lost: positive; read twice: negative */
    double log_chance;
} shift_t;

typedef struct {
    size_t at, within;
    /** reading = gain times what it would have been + offset; sigma of the gain 0: the offset alone does as well */
    double gain, gain_sigma, offset_um, offset_sigma_um;
    double log_chance;
} switch_t;

typedef struct {
    size_t shifts, switches;
    shift_t shift[CHANGES_MOST];
    switch_t change[CHANGES_MOST];
    lag_course_t clocks;       /**< size 0: none (look/path/clocks.h) */
    double before_um, left_um; /**< what the reference leaves, before and after these */
} changes_t;

#endif
