/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * What repeated paths of the drive make of the position: how well it comes back, and how each pass differs from the
 * others by a lag, an offset and a gain.
 *
 * Pass i of the mean path p is y = p - lag p' + offset + gain (p - mean p) + rest; lag in samples (later: positive),
 * offset in um, gain in parts. The passes are fitted by least squares, the mean path is a median over the passes laid
 * on top of each other, smoothed over five samples for p'. No model of the actuator is involved.
 */
#ifndef LOOK_REPETITION_H
#define LOOK_REPETITION_H

#include "look/signal/drive.h"

enum { REPETITION_LEAST_PASSES = 4 };

typedef struct {
    size_t at; /**< first sample */
    double lag, lag_sigma, offset_um, offset_sigma_um, gain, gain_sigma;
} pass_t;

typedef struct {
    double rms_um;       /**< of later less former pass over sqrt 2, in the middle (robust): noise, and what drifts */
    double worst_um;     /**< of that, the largest of a pass: root mean square */
    size_t count;        /**< of differences, in the order of time; 0: nothing repeated */
    double *difference;  /**< (later - former) / sqrt 2 of each sample of the repeated stretch but the last pass */
    double *slope;       /**< of the former: um a sample */
    size_t passes;       /**< 0 unless there are REPETITION_LEAST_PASSES */
    size_t path_samples; /**< of the mean path, at whole samples of the first pass */
    double *path;        /**< mean path, um */
    pass_t *pass;
    double left_um; /**< root mean square of the rest of the passes (robust) */
} repetition_t;

/** Of a recording whose drive repeats itself (drive->period); otherwise nothing. To be freed. */
void repetition_look(const recording_t *recording, const drive_look_t *drive, repetition_t *repetition);
void repetition_free(repetition_t *repetition);

#endif
