/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Holds over logarithmic time: what the position goes on to do while the drive rests.
 *
 * In a hold after a motion, y = a + b log10(t / 1 s) from 0.1 s (or a hundredth of the hold) on, t since the drive
 * stopped. b is the slope; relative to the change of the position before it (since the drive last turned round or
 * rested) it is the creep per decade. Its error is widened by the residuals' autocorrelation time.
 *
 * What rings (signal/settling.h) is fitted along with it. Where exponentials explain what such lines leave, it is a lag
 * that settles there: the fit begins when that is over, and holds that are too short for it are left out. So are those
 * within which most of the way comes.
 */
#ifndef LOOK_HOLDS_H
#define LOOK_HOLDS_H

#include "look/signal/drive.h"

typedef struct {
    look_span_t span;
    double decades;                  /**< of time that were looked at */
    double slope_um, slope_sigma_um; /**< per decade */
    double begins_um;                /**< where the line is one sample behind the drive's stop */
    double before_um;                /**< change of the position by the motion before it */
    double bend_um, bend_sigma_um;   /**< coefficient of log10^2: a straight line in log time has none */
} hold_t;

typedef struct {
    size_t count;
    hold_t *hold;
    double creep, creep_sigma; /**< per decade, slope over the change before, weighted over all; sigma 0: no hold */
} holds_t;

void holds_look(const recording_t *recording, const drive_look_t *drive, holds_t *holds);
void holds_free(holds_t *holds);

#endif
