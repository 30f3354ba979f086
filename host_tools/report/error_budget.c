/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "report/error_budget.h"
#include "base/failure.h"
#include <gsl/gsl_blas.h>
#include <gsl/gsl_multifit.h>
#include <gsl/gsl_statistics_double.h>
#include <math.h>
#include <stdlib.h>

/* RMS residual of `error` after regression on the first `columns` of `regressor`. *last: coefficient of the last one.
 */
static double rms_left(const gsl_matrix *regressor, const gsl_vector *error, size_t columns, double *last) {
    const gsl_matrix_const_view used = gsl_matrix_const_submatrix(regressor, 0, 0, regressor->size1, columns);
    gsl_multifit_linear_workspace *workspace = gsl_multifit_linear_alloc(regressor->size1, columns);
    gsl_vector *coefficient = gsl_vector_alloc(columns);
    gsl_matrix *covariance = gsl_matrix_alloc(columns, columns);
    double square_sum = 0.0;
    gsl_multifit_linear(&used.matrix, error, coefficient, covariance, &square_sum, workspace);
    *last = gsl_vector_get(coefficient, columns - 1);
    gsl_matrix_free(covariance);
    gsl_vector_free(coefficient);
    gsl_multifit_linear_free(workspace);
    return sqrt(square_sum / (double)error->size);
}

/*
 * White noise of deviation s has third differences of deviation sqrt(1 + 9 + 9 + 1) s; those of a smooth error are
 * negligible. The median is insensitive to the few samples at a step. (0.6745: median of |x| of a unit normal
 * distribution.)
 */
static double noise_deviation(const gsl_vector *error) {
    const size_t count = error->size - 3;
    double *third = allocate(count, sizeof *third);
    for (size_t k = 0; k < count; k++) {
        third[k] = fabs(gsl_vector_get(error, k + 3) - 3.0 * gsl_vector_get(error, k + 2) +
                        3.0 * gsl_vector_get(error, k + 1) - gsl_vector_get(error, k));
    }
    const double median = gsl_stats_median(third, 1, count);
    free(third);
    return median / (0.6745 * sqrt(20.0));
}

error_budget_t error_budget(const double *reference_um, const double *position_um, size_t samples,
                            double sample_rate_hz) {
    gsl_vector *error = gsl_vector_alloc(samples);
    gsl_matrix *regressor = gsl_matrix_alloc(samples, 3);
    for (size_t k = 0; k < samples; k++) {
        const size_t next = k + 1 < samples ? k + 1 : k, previous = k > 0 ? k - 1 : k;
        gsl_vector_set(error, k, position_um[k] - reference_um[k]);
        gsl_matrix_set(regressor, k, 0, 1.0);
        gsl_matrix_set(regressor, k, 1, reference_um[k]);
        gsl_matrix_set(regressor, k, 2,
                       -(reference_um[next] - reference_um[previous]) * sample_rate_hz / (double)(next - previous));
    }
    error_budget_t budget = {0};
    double gain = 0.0;
    const double whole = gsl_blas_dnrm2(error) / sqrt((double)samples);
    const double moving = rms_left(regressor, error, 2, &gain);
    const double left = rms_left(regressor, error, 3, &budget.delay_s);
    budget.static_um = sqrt(fmax(0.0, whole * whole - moving * moving));
    budget.delay_um = sqrt(fmax(0.0, moving * moving - left * left));
    budget.noise_um = fmin(noise_deviation(error), left);
    budget.rest_um = sqrt(left * left - budget.noise_um * budget.noise_um);
    gsl_matrix_free(regressor);
    gsl_vector_free(error);
    return budget;
}
