/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * What rings after a step of the drive: frequency and damping from the decay, without a model of what rings.
 *
 * After a step at sample 0, y = exp(-alpha t) (a cos 2 pi f t + b sin 2 pi f t) + c0 + c1 t + c2 t^2 + c3 log(1 + t / 1
 * sample) + c4 u(t). The linear coefficients are eliminated, f and alpha are found from the largest line of what is
 * left without them by a simplex search. Errors are those of the linearised problem, widened by the residuals'
 * autocorrelation time. A step counts as one that rings where two periods or more decay to 1/e, and the chance that
 * white noise does so well is below 10^-6.
 */
#ifndef LOOK_STEPS_H
#define LOOK_STEPS_H

#include "look/signal/drive.h"

enum { RING_MOST_STEPS = 64 };

typedef struct {
    size_t rings;                            /**< steps after which it rings with this frequency */
    size_t step[RING_MOST_STEPS];            /**< the first sample behind each of these */
    size_t at;                               /**< first sample behind the strongest one */
    double step_v;                           /**< of that */
    double swing_um;                         /**< amplitude of the ring right behind it */
    double frequency_hz, frequency_sigma_hz; /**< of the oscillation as seen, damped: weighted over all */
    double damping, damping_sigma;           /**< alpha / sqrt(alpha^2 + (2 pi f)^2) */
} ring_t;

/** rings = 0: nothing rings, or there is no step. */
void ring_look(const recording_t *recording, const drive_look_t *drive, ring_t *ring);

#endif
