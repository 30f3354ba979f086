/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Where the position stops while the drive goes on: levels of the drive beyond which an amplifier's rail holds it.
 *
 * Of each excursion of the drive beyond a level, the spread of the position is compared with that of a straight line
 * through the whole recording. A hysteresis follows a drive that still rises. Of 32 levels in the outer half of the
 * range, the innermost counts beyond which the position has less of it than threshold.rail_stops. The rail is where the
 * way into each excursion, a straight line over a 16th of the range, meets the position at which it stops.
 */
#ifndef LOOK_RAILS_H
#define LOOK_RAILS_H

#include "look/signal/drive.h"

typedef struct {
    bool low, high; /**< seen at this end of the drive */
    double low_v, high_v;
} rails_t;

/** noise_um: of a reading; excursions in which the line would not be seen beside it say nothing. */
void rails_look(const recording_t *recording, double noise_um, rails_t *rails);

#endif
