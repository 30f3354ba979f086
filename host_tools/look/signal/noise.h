/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Noise of the position, without a model: where the drive rests, and between repeated paths.
 *
 * The power density of either is taken as w + a / f (one-sided, um^2/Hz) and fitted to averaged periodograms by
 * Whittle's likelihood. white_um is sqrt(w fs / 2), the deviation of white noise of that density; slow_um that of the
 * a / f share between the lowest frequency that was looked at and half the sample rate. Readings far outside are left
 * out of both, and so are lines that have more than noise has by chance, with their skirts: hum, or a ring. How the
 * position settles in the rests (settling.h) is no noise.
 */
#ifndef LOOK_NOISE_H
#define LOOK_NOISE_H

#include "look/signal/repetition.h"

typedef struct {
    size_t samples; /**< it was seen in; 0: not seen */
    double rms_um;  /**< of all of it, readings far outside included */
    double white_um, slow_um;
    double other_um;  /**< what neither of both nor readings far outside are: hum, a ring, what is slower */
    double lowest_hz; /**< frequency from which on both shares were fitted */
    double kurtosis;  /**< fourth moment over the square of the second, 3 of normal noise */
    size_t outliers;  /**< readings beyond six robust deviations, from all or from their neighbours */
} noise_share_t;

typedef struct {
    noise_share_t rest;   /**< rests less their first 0.1 s or third, less a parabola and what settles */
    noise_share_t repeat; /**< later less former pass over sqrt 2; of three and more without the first */
    double digit_um;      /**< last digit of the file; 0: more than nine */
    double step_um;       /**< of the converter (resolution.h); 0: none seen */
} noise_look_t;

void noise_look(const recording_t *recording, const drive_look_t *drive, const repetition_t *repetition,
                noise_look_t *noise);

/** The better known of both: that of the rests, if any; else of the repetition; 0: neither. */
double noise_known_um(const noise_look_t *noise);

#endif
