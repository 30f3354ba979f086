/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Search for beta_s and rate_filter_s around the linear fit. */
#ifndef RATE_SEARCH_H
#define RATE_SEARCH_H

#include "base/progress.h"
#include "identify/linear_fit.h"

/** Bound of the feedback, slightly below the stability limit of the inverse, 0.9 (hyst/prandtl_ishlinskii.h). */
#define RATE_FEEDBACK_LIMIT 0.89

/**
 * Finds the beta_s and rate_filter_s with the least squared error and stores them, with their weights, in *basis and
 * *fit. Only pairs with beta_s (S_n - S_0) / S_n <= RATE_FEEDBACK_LIMIT * rate_filter_s are tried: then the inverse is
 * stable at every sample rate. beta_s = 0 is among them.
 */
bool rate_search(play_basis_t *basis, const fit_span_t *spans, size_t count, const linear_options_t *options,
                 linear_fit_t *fit, progress_t *progress, failure_t *failure);

#endif
