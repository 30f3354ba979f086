/* SPDX-License-Identifier: GPL-3.0-or-later */
/** The period of an oscillation, measured sample by sample between its crossings of a centre line. */
#ifndef PERIOD_TRACKER_H
#define PERIOD_TRACKER_H

#include <stdbool.h>

/** Initially all zero except `above` and `deviation`, which are those of the sample before the first step. */
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
 * Takes a sample. Returns the period in samples when it has just been measured, else 0. The first value comes from half
 * a period, later ones from a whole period, which an error of the centre does not bias. A crossing counts once the
 * signal exceeds the centre by a tenth of the last lobe's height, which rejects noise.
 */
double period_track(period_tracker_t *tracker, double deviation);

#endif
