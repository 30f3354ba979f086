/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Numbers that findings are given once they were found: harmonics of a line (probe_t.joins). */
#ifndef JOINED_H
#define JOINED_H

#include "diagnosis/answer/state.h"

/**
 * Fits everything that was found with all of these numbers, and again with those that are more than their standard
 * errors allow for (threshold.deviations). They stay if they are worth their price (threshold.number_price), and
 * samples that no fit saw miss them. With every finding they are tried again: what it leaves shows more. Where such a
 * fit fails, nothing joins.
 */
void joined_take(state_t *state);

#endif
