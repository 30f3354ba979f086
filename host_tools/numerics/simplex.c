/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "numerics/simplex.h"
#include "base/progress.h"
#include <gsl/gsl_multimin.h>
#include <math.h>

static double value_at(const gsl_vector *x, void *context) {
    const simplex_job_t *job = context;
    const double value = job->function(x->data, job->context);
    return isfinite(value) ? value : 1e300; /* the simplex does not take infinity */
}

double simplex_minimise(const simplex_job_t *job, double *x) {
    gsl_multimin_fminimizer *minimiser =
        gsl_multimin_fminimizer_alloc(gsl_multimin_fminimizer_nmsimplex2, job->dimensions);
    simplex_job_t copy = *job;
    gsl_multimin_function function = {.f = value_at, .n = job->dimensions, .params = &copy};
    gsl_vector *step = gsl_vector_alloc(job->dimensions);
    gsl_vector_const_view start = gsl_vector_const_view_array(x, job->dimensions);
    gsl_vector_set_all(step, job->step);
    gsl_multimin_fminimizer_set(minimiser, &function, &start.vector, step);
    /* Once in any case: before that there is no value of the best point. */
    for (size_t i = 0; i == 0 || (i < job->most_iterations && gsl_multimin_fminimizer_size(minimiser) > job->size);
         i++) {
        if (progress_cancelled() || gsl_multimin_fminimizer_iterate(minimiser) != 0) {
            break;
        }
    }
    const double least = minimiser->fval;
    for (size_t i = 0; i < job->dimensions; i++) {
        x[i] = gsl_vector_get(minimiser->x, i);
    }
    gsl_multimin_fminimizer_free(minimiser);
    gsl_vector_free(step);
    return least;
}
