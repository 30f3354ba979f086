/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * How much of a change in the readings is left after the numbers of a model have been fitted again.
 */
#ifndef PROOF_STRENGTH_H
#define PROOF_STRENGTH_H

#include "excitation.h"
#include <stdbool.h>

enum { REFIT_PLAYS = 10, REFIT_MOST_NUMBERS = 2 + REFIT_PLAYS };

/** Least squares of a change against columns; zeroed to start with. */
typedef struct {
    size_t numbers;
    double samples, square, with_change[REFIT_MOST_NUMBERS], products[REFIT_MOST_NUMBERS][REFIT_MOST_NUMBERS];
} refit_t;

/** Adds the readings of a recording without an effect, and what the effect changes in them: against gain and offset. */
void refit_add_gain(refit_t *refit, size_t samples, const double *without, const double *change);

/** The same against gain, offset and the weights of REFIT_PLAYS play operators of the drive, after a sweep of the
 * range.
 */
void refit_add_bank(refit_t *refit, const excitation_t *excitation, bool from_above, const double *without,
                    const double *change);

/** Rms of what is left. */
double refit_left(const refit_t *refit);

#endif
