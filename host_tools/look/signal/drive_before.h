/* SPDX-License-Identifier: GPL-3.0-or-later */
/** The drive at an instant that is none of its samples, for faults of clocks. */
#ifndef DRIVE_BEFORE_H
#define DRIVE_BEFORE_H

#include "look/signal/drive.h"

/** The drive of so many samples (negative: later) before sample k of n, as it moves between samples. Beyond the ends it
 * stays what it was there. */
double drive_before(const double *u, size_t n, drive_between_t between, size_t k, double samples);

#endif
