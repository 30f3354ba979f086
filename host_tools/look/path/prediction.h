/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Each reading from its neighbours in time and from the drive around it.
 *
 *     y[k] = c + a1 (y[k-1] + ..) .. + sum_j b_j y[k+j] + sum_i d_i u[k+i] + e[k]     j = +-1 .. +-3, i = -3 .. 3
 *
 * Least squares over the recording, a second time without the worst residuals. It is no model of the actuator: whatever
 * moves smoothly between samples, rings or follows the drive at once is predicted, and what is left is noise and what
 * happened to single readings. Around steps of the drive, and where it is not sampled finely enough, it predicts badly;
 * `quiet` leaves such places out. In a closed loop the drive knows the readings' noise, and is left out.
 */
#ifndef LOOK_PREDICTION_H
#define LOOK_PREDICTION_H

#include "look/signal/drive.h"

enum { PREDICTION_REACH = 3 };

typedef struct {
    size_t samples;
    double *error;        /**< e of each sample, um; 0 where it has no neighbours */
    unsigned char *quiet; /**< 1: far enough from steps of the drive */
    double sigma_um;      /**< of e, robust, where quiet; at least what rounding makes */
    /** What e shows of a single wrong reading is 1 of it there, and -echo[j] of it j + 1 samples to either side (mean
     * of both). */
    double echo[PREDICTION_REACH];
    bool fed_back;   /**< the drive answers the readings: it is left out of their prediction */
    double noise_um; /**< of the readings, if it is white: sigma_um less what the neighbours' noise adds */
} prediction_t;

void prediction_make(const recording_t *recording, const drive_look_t *drive, prediction_t *prediction);
void prediction_free(prediction_t *prediction);

#endif
