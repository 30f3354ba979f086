/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Gain and offset of the readings that were switched.
 *
 * What the columns make of the readings has some of the switch in it. So a gain acts on the path that they make with
 * the switch beside them. It is settled step by step: from the instant on the grid of windows that explains most, to
 * the windows around it, to the sample. Gain and offset are to be those of the path before. It is an offset alone where
 * that does as well. None is where the drive begins or ceases to rest, or takes up another speed
 * (threshold.switch_other_speed): what begins there is the actuator's.
 */
#ifndef LOOK_SWITCHES_H
#define LOOK_SWITCHES_H

#include "look/path/changes_problem.h"

/** Switches and left_um of the changes. path: what the columns make of the readings without a switch; middle_um: mean
 * of the recording's, which those of the problem do not have. */
void switches_find(problem_t *p, const recording_t *recording, const drive_look_t *drive, const double *path,
                   double middle_um, changes_t *changes);

#endif
