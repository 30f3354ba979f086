/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "look/signal/numbers.h"
#include "base/failure.h"
#include "numerics/least_squares.h"
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

/* Cholesky's factor of a scaled Gram matrix in place, lower triangle. A column of which those before it leave nearly
 * nothing gets a pivot so large that its coefficient is 0. */
static void factorise(double *gram, size_t n) {
    static const double least_pivot = 1e-10, no_column = 1e150;
    for (size_t j = 0; j < n; j++) {
        double pivot = gram[j * n + j];
        for (size_t k = 0; k < j; k++) {
            pivot -= gram[j * n + k] * gram[j * n + k];
        }
        pivot = pivot > least_pivot ? sqrt(pivot) : no_column;
        gram[j * n + j] = pivot;
        for (size_t i = j + 1; i < n; i++) {
            double sum = gram[i * n + j];
            for (size_t k = 0; k < j; k++) {
                sum -= gram[i * n + k] * gram[j * n + k];
            }
            gram[i * n + j] = sum / pivot;
        }
    }
}

static void forward(const double *factor, size_t n, double *x) {
    for (size_t i = 0; i < n; i++) {
        for (size_t k = 0; k < i; k++) {
            x[i] -= factor[i * n + k] * x[k];
        }
        x[i] /= factor[i * n + i];
    }
}

static void backward(const double *factor, size_t n, double *x) {
    for (size_t i = n; i-- > 0;) {
        for (size_t k = i + 1; k < n; k++) {
            x[i] -= factor[k * n + i] * x[k];
        }
        x[i] /= factor[i * n + i];
    }
}

/* In blocks of rows, so that a copy of the weighted columns is small. */
void look_products(const double *const *column, size_t columns, const double *weight, size_t rows, double *gram) {
    enum { BLOCK = 4096 };
    const size_t most = rows < BLOCK ? rows : BLOCK;
    double *block = allocate(columns * most, sizeof *block), *part = allocate(columns * columns, sizeof *part);
    memset(gram, 0, columns * columns * sizeof *gram);
    for (size_t from = 0; from < rows; from += most) {
        const size_t count = rows - from < most ? rows - from : most;
        for (size_t i = 0; i < columns; i++) {
            for (size_t k = 0; k < count; k++) {
                block[i * count + k] = column[i][from + k] * (weight == NULL ? 1.0 : sqrt(weight[from + k]));
            }
        }
        products_of_columns(block, count, columns, 0, part);
        for (size_t i = 0; i < columns * columns; i++) {
            gram[i] += part[i];
        }
    }
    free(block);
    free(part);
}

bool look_regress(const double *const *column, size_t columns, const double *value, const double *weight, size_t rows,
                  look_regression_t *result) {
    double *gram = allocate(columns * columns, sizeof *gram), scale[LOOK_MOST_COLUMNS];
    size_t used = 0;
    bool good;
    memset(result, 0, sizeof *result);
    for (size_t k = 0; k < rows; k++) {
        used += weight == NULL || weight[k] > 0.0 ? 1 : 0;
    }
    look_products(column, columns, weight, rows, gram);
    for (size_t i = 0; i < columns; i++) {
        scale[i] = gram[i * columns + i] > 0.0 ? 1.0 / sqrt(gram[i * columns + i]) : 0.0;
    }
    for (size_t i = 0; i < columns; i++) {
        for (size_t j = 0; j <= i; j++) {
            gram[i * columns + j] *= scale[i] * scale[j];
        }
    }
    good = used > columns;
    if (good) {
        factorise(gram, columns);
        double squares = 0.0, *left = allocate(rows, sizeof *left);
        for (size_t k = 0; k < rows; k++) {
            left[k] = (weight == NULL ? 1.0 : weight[k]) * value[k];
        }
        for (size_t i = 0; i < columns; i++) {
            result->coefficient[i] = cblas_ddot((int)rows, column[i], 1, left, 1) * scale[i];
        }
        forward(gram, columns, result->coefficient);
        backward(gram, columns, result->coefficient);
        for (size_t i = 0; i < columns; i++) {
            result->coefficient[i] *= scale[i];
        }
        memcpy(left, value, rows * sizeof *left);
        for (size_t i = 0; i < columns; i++) {
            cblas_daxpy((int)rows, -result->coefficient[i], column[i], 1, left, 1);
        }
        for (size_t k = 0; k < rows; k++) {
            squares += (weight == NULL ? 1.0 : weight[k]) * left[k] * left[k];
        }
        result->rms = sqrt(squares / (double)(used - columns));
        for (size_t i = 0; i < columns; i++) {
            double unit[LOOK_MOST_COLUMNS] = {0}, norm = 0.0;
            unit[i] = 1.0;
            forward(gram, columns, unit);
            for (size_t k = i; k < columns; k++) {
                norm += unit[k] * unit[k];
            }
            result->sigma[i] = result->rms * scale[i] * sqrt(norm);
        }
        free(left);
    }
    free(gram);
    return good;
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
