/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Least squares for the table of a Preisach model on given levels. docs/MODELS.md, section 7.
 *
 * The output is linear in the weights of the relays: one for each square of the grid, and for each triangle on the
 * diagonal the reversible part of that interval. They are bounded from below (squares 0, triangles a part of the mean
 * slope), so that all branches rise. Where the recording has no information, a smoothness penalty makes squares at the
 * same distance from the diagonal equal: a recording of a single loop gives a Prandtl-Ishlinskii model.
 */
#ifndef PREISACH_FIT_H
#define PREISACH_FIT_H

#include "base/failure.h"
#include "elements/preisach_grid.h"
#include "recording/recording.h"

/** Samples [from, to) of a recording; the memory runs from its first sample on. */
typedef struct {
    const recording_t *recording;
    size_t from, to;
    bool own_offset; /**< the state of the outermost relays is unknown: a constant is added to its position */
    size_t past;     /**< drives before the first sample, from all relays down on */
    const double *past_v;
} preisach_span_t;

typedef struct {
    double smoothing;   /**< weight of the smoothness penalty, relative to the data */
    double least_slope; /**< um/V, of the triangles */
    size_t most_rows;   /**< upper limit, kept by decimation; 0: all samples, which standard errors need */
} preisach_options_t;

typedef struct {
    size_t elements;
    double *everett_um;
    double offset_um;
    double rms_um; /**< of the residuals */
    size_t rows;
    /* set by preisach_fit_sigma */
    double *sigma_um; /**< of the elements; the whole range, E(last, 0), where the samples do not determine one */
    double offset_sigma_um;
    size_t determined; /**< elements whose standard error is below a twentieth of the whole range */
    double autocorrelation_samples;
} preisach_fit_t;

/** On success the caller frees *fit. */
bool preisach_fit(const preisach_grid_t *grid, const preisach_span_t *spans, size_t count,
                  const preisach_options_t *options, preisach_fit_t *fit, failure_t *failure);

/**
 * Standard errors from the samples alone, without the bounds and the smoothness, widened by the residuals'
 * autocorrelation. Where the penalty dominates they exceed the scatter of the fit: they show what the samples alone
 * determine.
 */
bool preisach_fit_sigma(const preisach_grid_t *grid, const preisach_span_t *spans, size_t count,
                        const preisach_options_t *options, preisach_fit_t *fit, failure_t *failure);

void preisach_fit_free(preisach_fit_t *fit);

/** The memory before the first sample of a span. */
void preisach_span_begin(const preisach_grid_t *grid, const preisach_span_t *span, preisach_memory_t *memory);

/** Output over [0, span->to). */
void preisach_predict(const preisach_grid_t *grid, const preisach_fit_t *fit, const preisach_span_t *span,
                      double *position_um);

#endif
