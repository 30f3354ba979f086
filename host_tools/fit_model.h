/* SPDX-License-Identifier: GPL-3.0-or-later */
/** The model that a finished fit becomes, with what is known about the fit. */
#ifndef FIT_MODEL_H
#define FIT_MODEL_H

#include "fit.h"

/** Room for thresholds to grow in an amplifier whose drive range is the recorded one, widened by 5 %, V. */
double model_growth_limit(double half_range_v, double largest_threshold_v);

/** initial_v: memory of the play operators before the first sample, or NULL. */
void make_fitted_model(const recording_t *recordings, size_t count, const play_basis_t *basis, const linear_fit_t *fit,
                       double beta_sigma_s, const double *initial_v, const fit_options_t *options,
                       const fit_report_t *report, model_t *model);

#endif
