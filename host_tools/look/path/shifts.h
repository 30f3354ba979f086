/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Samples of the position that were lost or read twice: from an instant on the readings are shifted by 1 to
 * CHANGES_MOST_SHIFT samples.
 *
 * On the grid of windows each shift at each instant is tried; the best is refined to the sample, the readings are set
 * right, and the search goes on as long as one more explains something. Only then each of them is judged, beside all
 * others. Of several shifts the first one may stand for all, and stays: so the search is also begun with steps of all
 * windows at once (look/path/lag_steps.h), and what leaves less stands. Shifts at one place are one. A lag that was
 * there all the time is no shift, and is taken out first.
 */
#ifndef LOOK_SHIFTS_H
#define LOOK_SHIFTS_H

#include "look/path/changes_problem.h"

/** Shifts, before_um and left_um of the changes, and readings that are set right for them. all: square that the columns
 * leave of the readings as they are. */
void shifts_find(problem_t *p, double all, changes_t *changes);

#endif
