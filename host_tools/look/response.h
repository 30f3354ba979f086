/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Frequency response from drive to position, with coherence, and the lag at each frequency.
 *
 * A drive that repeats itself: transforms over whole periods at the lines that carry power; the error is that of the
 * mean over the passes, from their scatter. Of a drive with one tone only the tone counts: its harmonics in the
 * position are distortion. Any other drive: the local polynomial method (Pintelon and Schoukens, System Identification,
 * 2nd edition, 2012, section 7.2): around each frequency, response and leakage are parabolas over 17 lines, fitted by
 * least squares, which leaves an error. Coherence is the part of the position's power there that goes with the drive,
 * the leakage left out. A point counts if a gain is seen there, or would be if it were that of the point that is known
 * best, and if the drive has power close to it. So there is no point above the band of a smooth drive, nor between the
 * lines of one that has few.
 *
 * It is the best linear description of a system with hysteresis at the amplitudes of this drive: a lag that does not
 * grow with frequency (constant phase) is what hysteresis makes.
 */
#ifndef LOOK_RESPONSE_H
#define LOOK_RESPONSE_H

#include "look/signal/drive.h"

typedef struct {
    double frequency_hz;
    double gain_um_per_v, gain_sigma; /**< sigma in um/V */
    double phase_rad, phase_sigma;    /**< negative: the position lags */
    double coherence;                 /**< 0 .. 1 */
    double lag_s;                     /**< -phase / (2 pi frequency) */
} response_point_t;

typedef struct {
    bool periodic;           /**< method: whole periods; otherwise local polynomials */
    size_t count;            /**< 0: the drive moves too little, or too short */
    response_point_t *point; /**< with rising frequency */
} response_t;

void response_look(const recording_t *recording, const drive_look_t *drive, response_t *response);
void response_free(response_t *response);

/** The point with the lowest frequency whose coherence is at least this; NULL without one. */
const response_point_t *response_lowest(const response_t *response, double coherence);
/** The highest maximum of the gain beyond the lowest point by 5 of its errors and a tenth: a mode. NULL without one. */
const response_point_t *response_peak(const response_t *response);

#endif
