/* SPDX-License-Identifier: GPL-3.0-or-later */
/** The period of an oscillation, measured sample by sample between its passages through a centre. */
#ifndef PERIOD_TRACKER_H
#define PERIOD_TRACKER_H

#include <stdbool.h>

/** Begin with all zero but `above` and `deviation`, which belong to the last sample before the first step. */
typedef struct {
    bool above;        /**< side of the present lobe */
    double deviation;  /**< from the centre at the last sample */
    double time;       /**< samples so far */
    double change;     /**< when its sign changed last, between samples */
    double passage[2]; /**< the last two that counted, latest first */
    int passages;      /**< that counted, up to 2 */
    double lobe;       /**< largest deviation since the last one that counted */
} period_tracker_t;

/**
 * Takes a sample. Returns the period in samples when it has just been measured, else 0: first from half a period, then
 * from a whole one, so that an error of the centre does not matter. A passage counts when the signal then gets a tenth
 * of the last lobe's height beyond the centre: noise does not.
 */
double period_track(period_tracker_t *tracker, double deviation);

#endif
