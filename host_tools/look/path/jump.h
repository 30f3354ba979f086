/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Whether the readings jump where a change is said to be: a step beside two straight lines through 6 rows to either
 * side, or 12, up to 200, as soon as the noise lets so large a step be seen. */
#ifndef LOOK_JUMP_H
#define LOOK_JUMP_H

#include "look/path/changes_problem.h"

typedef enum { JUMPS, DOES_NOT_JUMP, CANNOT_SAY } jump_t;

/** Whether a series, one a row, jumps by so much in front of a row, or of one that is `within` of it. */
jump_t jumps_around(const problem_t *p, const double *series, size_t row, size_t within, double expected);

#endif
