/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Search for gamma_per_decade around the fit of a hysteresis: creep is removed from the displacement, and the
 * hysteresis is fitted to the remaining elastic part. */
#ifndef CREEP_SEARCH_H
#define CREEP_SEARCH_H

#include "base/progress.h"
#include "elements/creep_cells.h"
#include "recording/recording.h"

/**
 * The exact inverse of block creep, and the block itself, over a whole signal. Before the first sample `initial`
 * (elastic) had been constant for a long time. elastic and position have `samples` elements and may be the same array.
 */
void creep_remove(const creep_cells_t *cells, const double *position, size_t samples, double initial, double *elastic);
void creep_apply(const creep_cells_t *cells, const double *elastic, size_t samples, double initial, double *position);

/** Fits a hysteresis to recordings with creep removed. Returns the mean squared residual and the number of samples. */
typedef bool creep_fit_t(void *context, const recording_t *elastic, double *mean_square, size_t *samples);

/**
 * Finds the gamma_per_decade with the least mean squared residual. *sigma: standard error from the curvature, for white
 * residuals. It is HUGE_VAL where the data do not determine gamma: without a minimum inside the range searched (-2 to 8
 * % a decade; piezo ceramics creep by 1 to 2, 5 at most). Returns false as soon as the fit does.
 */
bool creep_search(const recording_t *recordings, size_t count, creep_fit_t *fit, void *context,
                  double *gamma_per_decade, double *sigma, progress_t *progress);

/** The elastic position that was present before the recording, if its first sample was at rest. */
double creep_initial(const creep_cells_t *cells, const recording_t *recording);

/** Copies of the recordings whose displacement has creep removed, from creep_initial on. Freed with
 * creep_recordings_free. */
recording_t *creep_recordings(const recording_t *recordings, size_t count, double gamma_per_decade);
void creep_recordings_free(recording_t *elastic, size_t count);

/** The cells of block creep with its default times. */
creep_cells_t creep_default_cells(double gamma_per_decade, double sample_rate_hz);

#endif
