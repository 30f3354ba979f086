/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "look/signal/numbers.h"
#include "base/failure.h"
#include "numerics/column_factor.h"
#include <gsl/gsl_cblas.h>
#include <gsl/gsl_cdf.h>
#include <gsl/gsl_fft_complex.h>
#include <gsl/gsl_sf_erf.h>
#include <gsl/gsl_sort.h>
#include <gsl/gsl_statistics_double.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static double *sorted_copy(const double *value, size_t count) {
    double *sorted = allocate(count, sizeof *sorted);
    memcpy(sorted, value, count * sizeof *sorted);
    gsl_sort(sorted, 1, count);
    return sorted;
}

double look_quantile(const double *value, size_t count, double part) {
    double *sorted = sorted_copy(value, count);
    const double quantile = gsl_stats_quantile_from_sorted_data(sorted, 1, count, part);
    free(sorted);
    return quantile;
}

double look_robust_deviation(const double *value, size_t count) {
    static const double normal = 1.482602218505602; /* 1 / the 3/4 quantile of the normal distribution */
    const double median = look_quantile(value, count, 0.5);
    double *distance = allocate(count, sizeof *distance);
    for (size_t k = 0; k < count; k++) {
        distance[k] = fabs(value[k] - median);
    }
    const double deviation = normal * look_quantile(distance, count, 0.5);
    free(distance);
    return deviation;
}

double look_mean(const double *value, size_t count) {
    return gsl_stats_mean(value, 1, count);
}

double look_deviation(const double *value, size_t count) {
    const double mean = look_mean(value, count);
    double squares = 0.0;
    for (size_t k = 0; k < count; k++) {
        squares += (value[k] - mean) * (value[k] - mean);
    }
    return sqrt(squares / (double)count);
}

bool look_regress(const double *const *column, size_t columns, const double *value, const double *weight, size_t rows,
                  look_regression_t *result) {
    size_t used = 0;
    memset(result, 0, sizeof *result);
    for (size_t k = 0; k < rows; k++) {
        used += weight == NULL || weight[k] > 0.0 ? 1 : 0;
    }
    if (used <= columns) {
        return false;
    }
    column_factor_t factor;
    double squares = 0.0, *left = allocate(rows, sizeof *left);
    column_factor_make(&factor, column, columns, weight, rows);
    for (size_t k = 0; k < rows; k++) {
        left[k] = (weight == NULL ? 1.0 : weight[k]) * value[k];
    }
    for (size_t i = 0; i < columns; i++) {
        result->coefficient[i] = cblas_ddot((int)rows, column[i], 1, left, 1);
    }
    column_factor_whiten(&factor, result->coefficient, 1, columns);
    column_factor_solve(&factor, result->coefficient);
    memcpy(left, value, rows * sizeof *left);
    columns_add(column, columns, result->coefficient, -1.0, rows, left);
    for (size_t k = 0; k < rows; k++) {
        squares += (weight == NULL ? 1.0 : weight[k]) * left[k] * left[k];
    }
    result->rms = sqrt(squares / (double)(used - columns));
    double *unit = allocate(columns * columns, sizeof *unit);
    for (size_t i = 0; i < columns; i++) {
        unit[i * columns + i] = 1.0;
    }
    column_factor_whiten(&factor, unit, columns, columns);
    for (size_t i = 0; i < columns; i++) {
        result->sigma[i] = result->rms * cblas_dnrm2((int)columns, unit + i * columns, 1);
    }
    free(unit);
    column_factor_free(&factor);
    free(left);
    return true;
}

size_t look_smooth_length(size_t n) {
    size_t best = 1;
    for (size_t five = 1; five <= n; five *= 5) {
        for (size_t three = five; three <= n; three *= 3) {
            size_t two = three;
            while (two <= n / 2) {
                two *= 2;
            }
            best = two > best ? two : best;
        }
    }
    return best;
}

void look_transform(const double *value, size_t count, double *spectrum) {
    double *packed = allocate(2 * count, sizeof *packed);
    gsl_fft_complex_wavetable *table = gsl_fft_complex_wavetable_alloc(count);
    gsl_fft_complex_workspace *space = gsl_fft_complex_workspace_alloc(count);
    for (size_t k = 0; k < count; k++) {
        packed[2 * k] = value[k];
        packed[2 * k + 1] = 0.0;
    }
    gsl_fft_complex_forward(packed, 1, count, table, space);
    memcpy(spectrum, packed, 2 * (count / 2 + 1) * sizeof *spectrum);
    gsl_fft_complex_workspace_free(space);
    gsl_fft_complex_wavetable_free(table);
    free(packed);
}

void look_autocovariance(const double *value, size_t count, double *sums) {
    size_t length = 1;
    while (length < 2 * count) {
        length *= 2;
    }
    double *packed = allocate(2 * length, sizeof *packed);
    memset(packed, 0, 2 * length * sizeof *packed);
    for (size_t k = 0; k < count; k++) {
        packed[2 * k] = value[k];
    }
    gsl_fft_complex_radix2_forward(packed, 1, length);
    for (size_t k = 0; k < length; k++) {
        packed[2 * k] = packed[2 * k] * packed[2 * k] + packed[2 * k + 1] * packed[2 * k + 1];
        packed[2 * k + 1] = 0.0;
    }
    gsl_fft_complex_radix2_inverse(packed, 1, length);
    for (size_t k = 0; k < count; k++) {
        sums[k] = packed[2 * k];
    }
    free(packed);
}

double look_log_chance_normal(double z, double places) {
    static const double two = 0.6931471805599453;
    return fmin(0.0, (gsl_sf_log_erfc(fabs(z) / sqrt(2.0)) + log(places)) / (two + log(5.0)));
}

double look_log_chance_student(double t, double degrees, double places) {
    const double tail = 2.0 * gsl_cdf_tdist_Q(fabs(t), degrees);
    return tail > 0.0 ? fmin(0.0, log10(tail) + log10(places)) : -300.0;
}

double look_log_chance_binomial(double some, double all, double p, double places) {
    const double x = some / all;
    if (!(x > p)) {
        return 0.0;
    }
    const double other = x < 1.0 ? (1.0 - x) * log((1.0 - x) / (1.0 - p)) : 0.0;
    return fmin(0.0, -all * (x * log(x / p) + other) / log(10.0) + log10(places));
}
