/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * The linear part of the identification: offset and weights of a play bank whose thresholds are given.
 *
 *     y = offset + w_0 u + sum w_i z_i [+ drift log10((0.1 s + t) / (0.1 s + t_end))]
 *          w_0 >= least_direct, w_i >= 0
 *
 * The drift term is a nuisance parameter: it keeps creep of the offset out of the estimated weights. The offset is that
 * at the end of the training data. The drift is not part of the model.
 */
#ifndef LINEAR_FIT_H
#define LINEAR_FIT_H

#include "chain/chain.h"
#include "identify/play_basis.h"

/** Samples [from, to) of a recording. The play operators run from its first sample on, starting with initial_v (NULL:
 * demagnetised). */
typedef struct {
    const recording_t *recording;
    size_t from, to;
    const double *initial_v;
} fit_span_t;

typedef struct {
    bool drift;
    double least_direct; /**< um/V, lower bound of w_0 */
    double smoothing;    /**< 0 or more: penalty on second differences of w_1..w_n, relative to the data */
} linear_options_t;

typedef struct {
    size_t operators;
    double offset_um, drift_um; /**< drift per decade of time; 0 without drift */
    double *weight;             /**< um/V, operators + 1 */
    double offset_sigma_um;     /**< standard errors, set by linear_fit_sigma */
    double *weight_sigma;       /**< 0 where the weight is on its bound; NULL until then */
    double rms_um;              /**< of the residuals, with the drift */
    size_t samples;
} linear_fit_t;

/** On success the caller frees *fit with linear_fit_free. */
bool linear_fit(const play_basis_t *basis, const fit_span_t *spans, size_t count, const linear_options_t *options,
                linear_fit_t *fit, failure_t *failure);

/**
 * Standard errors under autocorrelated residuals: those of white noise times the square root of the residuals'
 * integrated autocorrelation time (Sokal's window, at least 1), which is also returned in *autocorrelation_samples.
 */
bool linear_fit_sigma(const play_basis_t *basis, const fit_span_t *spans, size_t count, const linear_options_t *options,
                      linear_fit_t *fit, double *autocorrelation_samples, failure_t *failure);

void linear_fit_free(linear_fit_t *fit);

/** Output of the bank (without drift) over [0, span->to) of the recording. */
void linear_fit_predict(const play_basis_t *basis, const linear_fit_t *fit, const fit_span_t *span,
                        double *position_um);

/** The drift term at sample k of the span. */
double linear_fit_drift(const linear_fit_t *fit, const fit_span_t *span, size_t k);

/** Error (without drift) over the samples [from, to) of the span. */
error_measure_t linear_fit_error(const play_basis_t *basis, const linear_fit_t *fit, const fit_span_t *span);

#endif
