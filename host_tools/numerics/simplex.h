/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Minimisation without derivatives: the Nelder-Mead simplex (GSL's nmsimplex2). */
#ifndef SIMPLEX_H
#define SIMPLEX_H

#include <stddef.h>

/** The cost. Infinite values count as very large ones. */
typedef double (*simplex_function_t)(const double *x, void *context);

typedef struct {
    simplex_function_t function;
    void *context;
    size_t dimensions;
    double step; /**< of the first simplex, in every direction */
    double size; /**< size of the simplex at which the search ends */
    size_t most_iterations;
} simplex_job_t;

/** Starts at x and leaves the best point there. Returns its value. */
double simplex_minimise(const simplex_job_t *job, double *x);

#endif
