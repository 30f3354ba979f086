/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Two clocks: a lag that grows steadily and jumps back by one sample, over and over, against the columns of the
 * reference.
 *
 * A lag L(t) leaves -L p' of the path p, beside what the columns make of that: in a saw tooth they can follow much of
 * it, and its size against a fixed path came out as a third. The fit of the columns is exact in each trial. All that is
 * needed are sums in windows: A of e p', B of p'^2, and C, the products of p' with the columns. With W, which whitens
 * by the columns' Gram matrix, the size of a course L is
 *
 *     -sum L A / (sum L^2 B - |W sum L C|^2)
 */
#ifndef LOOK_CLOCKS_H
#define LOOK_CLOCKS_H

#include "look/path/changes_problem.h"
#include "look/path/lags.h"

/** The saw tooth that explains most, of 1.5 teeth to 48 over the rows and 16 phases, then finer. teeth_per_s and phase
 * are those of the recording's time; left: sum of squares that the columns leave beside it. without, residual: what
 * they leave without it; residual becomes that beside it. */
void clocks_find(problem_t *p, double rate_hz, double without, double *residual, lag_course_t *saw);

#endif
