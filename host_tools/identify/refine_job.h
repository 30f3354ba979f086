/* SPDX-License-Identifier: GPL-3.0-or-later */
/** What refine.h is to fit, to which recordings. */
#ifndef REFINE_JOB_H
#define REFINE_JOB_H

#include "base/progress.h"
#include "recording/recording.h"

/** A parameter of the model that is to be fitted. */
typedef struct {
    size_t block, parameter, element; /**< of model_t; element 0 for a scalar */
    double low, high;                 /**< bounds, inclusive; may be infinite */
    bool logarithmic;                 /**< searched on a logarithmic scale; value and low > 0 */
} refine_unknown_t;

typedef struct {
    const recording_t *recordings;
    size_t count;
    /** The samples included are [from, to), one pair per recording. from NULL: those at which the memory is determined
     * in the initial model (all, if less than a quarter would remain). to NULL: the ends. */
    const size_t *from, *to;
    bool offsets; /**< every recording has a separate unknown offset, which is removed and not part of the model */
    const refine_unknown_t *unknown;
    size_t unknowns;        /**< 1 or more */
    size_t most_iterations; /**< 0: the model stays as it is, and only the standard errors are computed */
    progress_t *progress;   /**< or NULL */
} refine_job_t;

#endif
