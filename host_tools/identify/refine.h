/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Joint nonlinear least squares: fits selected parameters of a chain to recordings by simulation of the whole chain,
 * and computes their standard errors. docs/IDENTIFICATION.md, section 2.8.
 *
 * Minimises the sum of squares of displacement - simulation over all samples included, by the Levenberg-Marquardt
 * method. Derivatives are finite differences between simulations that differ in one parameter; the stages before its
 * block are not simulated again. The search is local: it finds the minimum nearest downhill from the initial model.
 */
#ifndef REFINE_H
#define REFINE_H

#include "chain/chain.h"
#include "identify/refine_job.h"

typedef enum {
    REFINE_DETERMINED,
    REFINE_AT_BOUND, /**< on low or high, with the minimum beyond it */
    /** It has no effect, or other parameters can replace it, or its standard error is too large. The limits are half
     * its range, its value (logarithmic), the peak-to-peak drive or displacement or the length of the recording (V, um,
     * s), half the sample rate (Hz), or an effect larger than the displacement itself. */
    REFINE_NOT_DETERMINED
} refine_state_t;

typedef struct {
    size_t unknowns;
    refine_state_t *state;
    double *sigma; /**< one standard error, in the unit of the number; HUGE_VAL: not determined; 0: at its bound */
    double *correlation;            /**< unknowns^2, of the errors; 0 for numbers without one */
    double *offset_um;              /**< one per recording; 0 without offsets */
    size_t samples;                 /**< included */
    double rms_um;                  /**< of the residuals */
    double autocorrelation_samples; /**< of the residuals, in samples (autocorrelation.h) */
    size_t iterations;
    /** The next step is below a thousandth of the standard errors, or below one standard error where no step reduces
     * the sum of squares (at a kink). True when most_iterations is 0. */
    bool converged;
} refine_report_t;

/** An unknown over the whole range that its block allows; logarithmic if that is positive. */
refine_unknown_t refine_unknown_at(const model_t *model, size_t block, size_t parameter, size_t element);
/** By name: the first block of that name. Both must be in the model (a programming error otherwise). */
refine_unknown_t refine_unknown(const model_t *model, const char *block, const char *parameter, size_t element);

/**
 * Fits the unknowns of the model; its standard errors stay unchanged. Fails if the initial model is refused or
 * diverges, or if a recording has no sample to include; the model is then unchanged. On success the caller frees
 * *report.
 */
bool refine(model_t *model, const refine_job_t *job, refine_report_t *report, failure_t *failure);

/** Writes the standard errors into the model, except for parameters that already have one. */
void refine_keep_errors(model_t *model, const refine_job_t *job, const refine_report_t *report);

void refine_report_free(refine_report_t *report);

#endif
