/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Where a sampled drive turned between two samples, and how far it went.
 *
 * A hysteresis remembers the extremes of its drive, and a recording has only the samples beside them. For a drive of 40
 * samples a period the extreme is up to 0.3 % of the amplitude beyond the next sample; that is more than the noise of a
 * good sensor, and it changes from period to period.
 *
 * Around each turn of the samples there are five stencils of five samples that contain the turning sample. Each has one
 * quartic through it; the one with the least fourth difference is taken, as in essentially non-oscillatory schemes
 * (Harten and others, J. Comput. Phys. 71, 1987): where the drive has a corner, the quartics across it swing, and the
 * one on a straight side has no extreme at all, so that a corner stays as it was sampled.
 */
#ifndef OPERATOR_TURNS_H
#define OPERATOR_TURNS_H

#include <stddef.h>

/**
 * way[k] = where the drive went between value[k - 1] and value[k], if that is beyond both; NAN elsewhere. samples
 * values each. A turn whose quartic swings by more than it bends is left out: the drive is not smooth there.
 */
void turns_find(const double *value, size_t samples, double *way);

#endif
