/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "numerics/period_tracker.h"
#include <math.h>

/* Part of the last lobe. */
static const double least_lobe = 0.1;

double period_track(period_tracker_t *tracker, double deviation) {
    const bool above = deviation > 0.0;
    double period = 0.0;
    tracker->time += 1.0;
    if (above != (tracker->deviation > 0.0)) {
        tracker->change = tracker->time - deviation / (deviation - tracker->deviation);
    }
    tracker->deviation = deviation;
    if (above == tracker->above) {
        tracker->lobe = fmax(tracker->lobe, fabs(deviation));
    } else if (fabs(deviation) > least_lobe * tracker->lobe) {
        if (tracker->passages > 0) { /* two halves: an error of the centre makes one longer and the other shorter */
            period = tracker->passages == 2 ? tracker->change - tracker->passage[1]
                                            : 2.0 * (tracker->change - tracker->passage[0]);
        }
        tracker->passage[1] = tracker->passage[0];
        tracker->passage[0] = tracker->change;
        tracker->passages = tracker->passages < 2 ? tracker->passages + 1 : 2;
        tracker->above = above;
        tracker->lobe = fabs(deviation);
    }
    return period;
}
