/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Whether and where a drive repeats itself. */
#ifndef LOOK_PERIOD_H
#define LOOK_PERIOD_H

#include "look/signal/drive_look.h"

/** Sets period, repeat and harmonics of the drive; its range, noise and rests are known. */
void period_find(const double *u, size_t samples, drive_look_t *drive);

#endif
