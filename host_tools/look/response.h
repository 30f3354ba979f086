/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Frequency response from drive to position, with coherence, and the lag at each frequency.
 *
 * A drive that repeats itself: transforms over whole periods at the lines that carry power; the error is that of the
 * mean over the passes, from their scatter. Of a drive with one tone only the tone counts: its harmonics in the
 * position are distortion.
 *
 * Any other drive: the local polynomial method (Pintelon and Schoukens, System Identification, 2nd edition, 2012,
 * section 7.2). Around each frequency, response and leakage (of what was before and comes behind) are parabolas over 17
 * lines, fitted by least squares. Coherence is the part of the position's power there that goes with the drive, the
 * leakage left out. A point counts if a gain is seen there, or would be if it were that of the point that is known
 * best, and if the drive has power close to it. So there is no point above the band of a smooth drive, nor between the
 * lines of one that has few. Below the ninth line there is one point at most, where the drive has most.
 *
 * - The spectra of a tone that fades and of a sweep's end are as smooth as leakage, and the response's slope and bend
 *   there are leakage as well. They are not fitted then. The gain of a tone comes from the lines in the middle, and
 * does not need them. Elsewhere the error has what they would have changed.
 * - The error takes what the parabolas leave as white, if the lines agree with that. Distortion is where the drive is,
 *   and where a gain hangs on one line the fit leaves nearly nothing of it, right or wrong. A line that has more than
 *   noise would leave of it makes the error: how far the gain moves without this line.
 * - Of a sine whose amplitude changes only the tone counts, as of one that repeats itself.
 *
 * It is the best linear approximation of a system with hysteresis for this very drive: the linear system that leaves
 * least of the position, of all amplitudes at once. A lag that does not grow with frequency (constant phase) is what
 * hysteresis makes. Another amplitude has another response. Where amplitudes change within a recording, the lines
 * beside a tone follow the loop's growth with its amplitude, and the tone its size: the error holds how far they
 * disagree.
 *
 * A sweep passes its highest frequencies within less time than a window tells from an end of the recording: 17 lines
 * are an eighth of the recording's length or so. Where the response ends below them, it is said up to where the drive
 * goes.
 *
 * Limits: distortion that falls on lines of the drive itself (harmonics of a triangle, of a multisine) is part of the
 * response. The skirts of shrinking rasters still have points that are off by more than their errors.
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
    double goes_on_to_hz;    /**< a sweep goes on to here beyond the last point; 0: no, or no sweep */
    double goes_on_s;        /**< for so long, at an end of the recording */
} response_t;

void response_look(const recording_t *recording, const drive_look_t *drive, response_t *response);
void response_free(response_t *response);

/** The point with the lowest frequency whose coherence is at least this; NULL without one. */
const response_point_t *response_lowest(const response_t *response, double coherence);
/** The highest gain beyond that of the lowest point by 5 of its errors and a tenth: a mode, or on the way to one that
 * is beyond the last point. NULL without one. */
const response_point_t *response_peak(const response_t *response);

#endif
