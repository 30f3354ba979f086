/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Shared by the two estimates of recursion_fit.h: the rows of the linear problem, and the errors of an estimate. */
#ifndef RECURSION_ROWS_H
#define RECURSION_ROWS_H

#include "identify/recursion_problem.h"

enum {
    RECURSION_AFTER = RECURSION_HARMONICS + 1, /**< harmonics and offset, after the columns */
    /** Also the last positions and the bilinear term. */
    RECURSION_ROW = RECURSION_FIT_COLUMNS + RECURSION_AFTER + RECURSION_FEEDBACK + 1
};

/** Goes along the recording and gives the row of each sample: columns, harmonics, 1. */
typedef struct {
    const recursion_problem_t *problem;
    size_t sample;
    double angle_step;
} recursion_rows_t;

recursion_rows_t recursion_rows_begin(const recursion_problem_t *problem, const double *shape);
void recursion_rows_step(recursion_rows_t *rows, double *row);

/** u of the sample before k; at k = 0 that of the first sample. */
double recursion_input_before(const recursion_problem_t *problem, size_t k);

/** Sets both errors of an estimate. */
void recursion_judge(const recursion_problem_t *problem, recursion_estimate_t *estimate);

/** Weights, harmonics and offset of the estimate, from the solution x. */
void recursion_take(const recursion_problem_t *problem, const double *x, recursion_estimate_t *estimate);

#endif
