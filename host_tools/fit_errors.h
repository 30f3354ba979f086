/* SPDX-License-Identifier: GPL-3.0-or-later */
/** The standard errors that a family leaves open, and what the recordings do not determine. */
#ifndef FIT_ERRORS_H
#define FIT_ERRORS_H

#include "family.h"

/** Most numbers of a model whose joint errors are found: each costs a simulation. */
#define FIT_MAX_ERRORS 100

/**
 * Gives every number that the fit has found a standard error (refine.h), where it has none yet, from samples
 * [0, train_to[i]) of the recordings; errors are joint ones of all numbers found. Notes say which numbers the
 * recordings do not determine and which of them stand for each other. With more than FIT_MAX_ERRORS numbers it only
 * says so; with "smoothing" among the facts of the fit it does nothing.
 */
bool fit_find_errors(model_t *model, const recording_t *recordings, size_t count, const size_t *train_to,
                     progress_t *progress, family_notes_t *notes, failure_t *failure);

/** Numbers of the model that a fit has found: neither chosen, nor left at a default, nor resting on a bound. */
size_t fit_count_found(const model_t *model);

#endif
