/* SPDX-License-Identifier: GPL-3.0-or-later */
/** The memory that a model's hysteresis begins with, where the recordings alone do not say it. */
#ifndef PAST_CHOICE_H
#define PAST_CHOICE_H

#include "diagnosis/noise/samples.h"

/** What a model leaves with the past that it has, by some measure. It may move the model's other numbers. */
typedef double left_of_past_t(void *context, const samples_t *samples, model_t *model);

/** Leaves the model its past, or gives it what a sweep of the whole drive range leaves that came to the first level
 * from above or from below: whichever leaves least. Returns
 * whether that is another one. */
bool choose_past(const samples_t *samples, left_of_past_t *left_of, void *context, model_t *model);

/** The error of a model that is simulated, in any unit. Called by several threads. */
typedef double error_of_model_t(const samples_t *samples, const model_t *model);

/** Gives the model one of 25 pasts (from an end of the range to one level, and on to another), or none (demagnetised),
 * if that leaves less than `least`. Returns whether it does. */
bool choose_past_by_error(const samples_t *samples, error_of_model_t *error, double least, model_t *model);

/** A measure: what is left of the excluded samples, in which the past is, but for a constant: that may be
 * anything's. context: NULL. */
double left_of_beginning(void *context, const samples_t *samples, model_t *model);

#endif
