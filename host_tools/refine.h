/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Joint nonlinear least squares: chosen numbers of a chain, fitted to recordings by simulating the whole chain, and how
 * well the recordings determine them. docs/IDENTIFICATION.md, section 2.8.
 *
 * Minimises the sum of squares of displacement - simulation over all samples that count, by Levenberg's and Marquardt's
 * method. Derivatives are differences between simulations that differ in one number; the stages before the block it
 * belongs to are not simulated again. The minimum that is found is the one whose valley the model starts in.
 */
#ifndef REFINE_H
#define REFINE_H

#include "chain.h"
#include "progress.h"

/** A number of the model that may change. */
typedef struct {
    size_t block, parameter, element; /**< of model_t; element 0 for a scalar */
    double low, high;                 /**< where it is searched, inclusive; may be infinite */
    bool logarithmic;                 /**< searched in its logarithm; value and low > 0 */
} refine_unknown_t;

typedef struct {
    const recording_t *recordings;
    size_t count;
    /** First sample that counts, and the one behind the last, one a recording. from NULL: those whose memory is
     * determined in the model as it comes in (all, if that leaves less than a quarter). to NULL: the ends. */
    const size_t *from, *to;
    bool offsets; /**< every recording has an unknown offset of its own, which is taken out and not part of the model */
    const refine_unknown_t *unknown;
    size_t unknowns;        /**< 1 or more */
    size_t most_iterations; /**< 0: the model stays as it is, and only the errors are found */
    progress_t *progress;   /**< or NULL */
} refine_job_t;

typedef enum {
    REFINE_DETERMINED,
    REFINE_AT_BOUND, /**< rests on low or high, and the data would have it beyond */
    /** Has no effect, or others can take its place, or its standard error is larger than half its range, the number
     * itself (logarithmic), the drive's or the displacement's peak-to-peak value, the recording (for V, um, s), half
     * the sample rate (Hz), or moves the displacement by more than all of its own. */
    REFINE_NOT_DETERMINED
} refine_state_t;

typedef struct {
    size_t unknowns;
    refine_state_t *state;
    double *sigma; /**< one standard error, in the unit of the number; HUGE_VAL: not determined; 0: at its bound */
    double *correlation;            /**< unknowns^2, of the errors; 0 for numbers without one */
    double *offset_um;              /**< one a recording; 0 without offsets */
    size_t samples;                 /**< that counted */
    double rms_um;                  /**< of the residuals */
    double autocorrelation_samples; /**< so many residuals count as one (autocorrelation.h) */
    size_t iterations;
    /** The next step would be below a thousandth of the standard errors, or below one where there is no way down (a
     * kink of the sum of squares). True when most_iterations is 0. */
    bool converged;
} refine_report_t;

/** An unknown over the whole range that its block allows; logarithmic if that is positive. */
refine_unknown_t refine_unknown_at(const model_t *model, size_t block, size_t parameter, size_t element);
/** By name: the first block of that name. Both must be in the model (a programming error otherwise). */
refine_unknown_t refine_unknown(const model_t *model, const char *block, const char *parameter, size_t element);

/**
 * Changes the unknowns of the model (and no standard errors there). Fails when the model is refused or runs away at its
 * start, or a recording has no sample that counts; the model is then as it was. On success the caller frees *report.
 */
bool refine(model_t *model, const refine_job_t *job, refine_report_t *report, failure_t *failure);

/** Writes the standard errors into the model; parameters that have some already keep them. */
void refine_keep_errors(model_t *model, const refine_job_t *job, const refine_report_t *report);

void refine_report_free(refine_report_t *report);

#endif
