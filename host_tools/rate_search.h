/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Search of beta_s and rate_filter_s around the linear problem. */
#ifndef RATE_SEARCH_H
#define RATE_SEARCH_H

#include "linear_fit.h"
#include "progress.h"

/** Room below the stability limit of the inverse, which is 0.9 (hyst/prandtl_ishlinskii.h). */
#define RATE_FEEDBACK_LIMIT 0.89

/**
 * Finds the beta_s and rate_filter_s with the least squared error and leaves them, with the weights that belong to
 * them, in *basis and *fit. Only pairs with beta_s (S_n - S_0) / S_n <= RATE_FEEDBACK_LIMIT * rate_filter_s are tried:
 * then the inverse is stable at every sample rate. beta_s = 0 is among them.
 */
bool rate_search(play_basis_t *basis, const fit_span_t *spans, size_t count, const linear_options_t *options,
                 linear_fit_t *fit, progress_t *progress, failure_t *failure);

#endif
