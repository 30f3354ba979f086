/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Initial memory of the play operators at the start of a recording.
 *
 * The memory of a play bank is a function of the threshold that the past drive determines. The search covers the
 * memories of short pasts: rest at some voltage, moves to two extremes, then to the first drive of the recording. The
 * memories of all operators are then consistent, as after a real past, and a few samples suffice.
 */
#ifndef INITIAL_MEMORY_H
#define INITIAL_MEMORY_H

#include "identify/linear_fit.h"

/**
 * Where the recording's header says what the drive was before it (drive_before_v), the memory is that. Elsewhere it
 * finds the past that fits the samples [0, end) best, by the least sum of absolute errors, which is robust against a
 * transient. memory_v has basis->operators elements. Returns the mean absolute error in um.
 */
double estimate_initial_memory(const play_basis_t *basis, const linear_fit_t *fit, const recording_t *recording,
                               size_t end, double *memory_v);

#endif
