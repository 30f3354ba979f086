/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Standard errors that a family did not compute, and parameters that the recordings do not determine. */
#ifndef FIT_ERRORS_H
#define FIT_ERRORS_H

#include "identify/family.h"

/** Most parameters of a model whose joint standard errors are computed: each costs a simulation. */
#define FIT_MAX_ERRORS 100

/**
 * Computes the missing standard errors of all fitted parameters (refine.h), jointly, from samples [0, train_to[i]) of
 * the recordings. Notes list the parameters that the recordings do not determine, and those that are strongly
 * correlated. With more than FIT_MAX_ERRORS parameters there is only a note; with "smoothing" in model->fit nothing is
 * done.
 */
bool fit_find_errors(model_t *model, const recording_t *recordings, size_t count, const size_t *train_to,
                     progress_t *progress, family_notes_t *notes, failure_t *failure);

/** Number of fitted parameters of the model: neither chosen, nor at a default, nor on a bound. */
size_t fit_count_found(const model_t *model);

#endif
