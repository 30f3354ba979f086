/* SPDX-License-Identifier: GPL-3.0-or-later */
/** By how many samples readings are late, as steps in time: all of them at once. */
#ifndef LOOK_LAG_STEPS_H
#define LOOK_LAG_STEPS_H

#include "look/path/changes_problem.h"

/** The lag of each window, in samples, with which the readings y[k - lag] leave least beside what is expected of rows 0
 * to n - 1; each step of it costs `price`, a square (Viterbi 1967). Lags reach to PROBLEM_EDGE, steps to
 * CHANGES_MOST_SHIFT. lag: room for p->windows. */
void lag_steps(const problem_t *p, const double *expected, double price, int *lag);

#endif
