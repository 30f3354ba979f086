/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * What the play operators remembered when a recording began.
 *
 * The memory of a play bank is a curve over the threshold that the past drive has left. It is searched among the curves
 * that a short past leaves: rest at some voltage, then moves to one and to another extreme, then to the first drive of
 * the recording. So the operators agree with each other, as memories that a real past has left do, and a few samples
 * suffice.
 */
#ifndef INITIAL_MEMORY_H
#define INITIAL_MEMORY_H

#include "linear_fit.h"

/**
 * Finds the past that explains the samples [0, end) best (least sum of absolute errors, so that a transient does not
 * decide). memory_v has basis->operators elements. Returns the mean absolute error in um.
 */
double estimate_initial_memory(const play_basis_t *basis, const linear_fit_t *fit, const recording_t *recording,
                               size_t end, double *memory_v);

#endif
