/* SPDX-License-Identifier: GPL-3.0-or-later */
/** The least-squares problem of refine.h: its sum of squares, and its normal equations at a point. */
#ifndef REFINE_PROBLEM_H
#define REFINE_PROBLEM_H

#include "chain/chain_stream.h"
#include "identify/refine_job.h"
#include "numerics/least_squares.h"

typedef struct {
    model_t *model; /**< holds the present values of the search */
    const refine_job_t *job;
    size_t *from, *to; /**< samples included, one pair per recording */
    double *preload_n; /**< one per recording */
    size_t samples;    /**< samples included, of all recordings */
    double power;      /**< sum of squares of their displacement around its mean, recording by recording */
    double stroke_um;  /**< largest peak-to-peak displacement of one recording */
    double largest_um; /**< largest magnitude of displacement */
    double drive_v;    /**< largest peak-to-peak drive of one recording */
    double duration_s; /**< of the longest recording */
    size_t stages, order[MODEL_MAX_BLOCKS];
} refine_problem_t;

/** *problem must be freed in any case. */
bool refine_problem_open(refine_problem_t *problem, model_t *model, const refine_job_t *job, failure_t *failure);
void refine_problem_free(refine_problem_t *problem);

/** The parameter in the model. */
double *refine_value(const refine_problem_t *problem, size_t unknown);
/** The unknown in the coordinate of the search: its value or the logarithm of it. */
double refine_get(const refine_problem_t *problem, size_t unknown);
void refine_set(const refine_problem_t *problem, size_t unknown, double x);
/** The bounds in that coordinate. */
double refine_low(const refine_problem_t *problem, size_t unknown);
double refine_high(const refine_problem_t *problem, size_t unknown);

/** The simulation of recording i from one stage on, with the present parameters; not yet settled. */
chain_stream_t refine_stream(const refine_problem_t *problem, size_t i, size_t first);

/** displacement - simulation - offset over the included samples of recording i. False when the model is refused or its
 * simulation is not finite. */
bool refine_residual(const refine_problem_t *problem, size_t i, double *residual, double *offset_um);

/** Sum of squared residuals; HUGE_VAL when the model is refused or diverges. */
double refine_cost(const refine_problem_t *problem);

/** The equations whose solution is the Gauss-Newton step (refine_equations.c). The caller frees *equations. */
void refine_equations(const refine_problem_t *problem, normal_equations_t *equations);

#endif
