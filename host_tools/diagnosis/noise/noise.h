/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * The sensor's noise: how large it is and how its neighbours resemble each other, from the recording itself, as a
 * first-order noise with white noise on top (noise_filter.h). No more than that: a filter of higher order would take
 * the tone, the ringing and the drift that a diagnosis is to find for colours of the noise.
 */
#ifndef NOISE_H
#define NOISE_H

#include "diagnosis/noise/noise_filter.h"
#include "diagnosis/noise/samples.h"

typedef struct {
    noise_filter_t filter;
    double sigma_um; /**< of e, the part that cannot be predicted */
    double rms_um;   /**< of x */
    /** Found without a model: where the drive rests, or in what passes of one path differ by. */
    bool at_rest, between_passes;
    size_t samples; /**< it was found in */
} noise_t;

/**
 * From what the readings do while the drive rests (longer than a twentieth of a second, less the first tenth of a
 * second or a third of it, less a parabola and the lines at these frequencies). false: there is not enough rest.
 * left: what a model leaves of the readings, a column, in their place; NULL: themselves.
 */
bool noise_at_rest(const samples_t *samples, const double *left, const double *line_hz, size_t lines, noise_t *noise);

/**
 * From what the readings differ by when the drive goes its path again, less a parabola, the lines, the drive and its
 * rate: so a gain or a lag that drifts is no noise. Passes that are far apart are compared, so that slow noise is in
 * it, by a number of whole samples if there is one, else between samples. The first pass may not have settled; of two,
 * it is used from where the hysteresis has forgotten what was before. passes: of each recording. Two recordings with
 * the same drive, sample by sample, are passes of one path as well. false: too few samples come again.
 */
bool noise_between_passes(const samples_t *samples, const probe_passes_t *passes, const double *line_hz, size_t lines,
                          noise_t *noise);

/** From what a rich model has left of the residual: a column. explained: the model's columns (or NULL), which took
 * their part of the noise, too; of a slow noise most of it. */
void noise_of(const samples_t *samples, const basis_t *explained, const double *left, noise_t *noise);

/** e of a column: what the filter makes of it. From the first included sample of each recording; 0 before. */
void noise_whiten(const noise_t *noise, const samples_t *samples, const double *column, double *white);
/** The same of the samples that are fitted, one after the other: samples->fitted of them. */
void noise_whiten_fitted(const noise_t *noise, const samples_t *samples, const double *column, double *rows);

#endif
