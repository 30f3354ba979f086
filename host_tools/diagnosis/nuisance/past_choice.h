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

/** A measure: what is left of the excluded samples, in which the past is, but for a constant: that may be
 * anything's. context: NULL. */
double left_of_beginning(void *context, const samples_t *samples, model_t *model);

#endif
