/* SPDX-License-Identifier: GPL-3.0-or-later */
/** What the two estimates of recursion_fit.h share: the rows of the linear problem, and how an estimate is judged. */
#ifndef RECURSION_ROWS_H
#define RECURSION_ROWS_H

#include "recursion_fit.h"

enum {
    RECURSION_AFTER = RECURSION_HARMONICS + 1, /**< harmonics and offset, behind the columns */
    /** Also last positions, and the bilinear term. */
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

/** u of the sample before k; what stands before the first is taken as equal to it. */
double recursion_input_before(const recursion_problem_t *problem, size_t k);

/** Sets both errors of an estimate. */
void recursion_judge(const recursion_problem_t *problem, recursion_estimate_t *estimate);

/** Weights, harmonics and offset of the estimate, from the solution x. */
void recursion_take(const recursion_problem_t *problem, const double *x, recursion_estimate_t *estimate);

#endif
