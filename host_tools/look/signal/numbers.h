/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Small numerics that the parts of the look share: order statistics, a regression with errors, a Fourier transform. */
#ifndef LOOK_NUMBERS_H
#define LOOK_NUMBERS_H

#include <stdbool.h>
#include <stddef.h>

/** Samples [from, to). */
typedef struct {
    size_t from, to;
} look_span_t;

static inline size_t span_length(look_span_t span) {
    return span.to - span.from;
}

/** Quantile 0 <= part <= 1 of count > 0 values, which stay as they are. */
double look_quantile(const double *value, size_t count, double part);
/** Deviation of a normal distribution with the same median of distances from the median: 1.4826 MAD. count > 0. */
double look_robust_deviation(const double *value, size_t count);
double look_mean(const double *value, size_t count);
/** Root mean square about the mean. */
double look_deviation(const double *value, size_t count);

/** Most columns of a regression. */
enum { LOOK_MOST_COLUMNS = 112 };

typedef struct {
    double coefficient[LOOK_MOST_COLUMNS];
    double sigma[LOOK_MOST_COLUMNS]; /**< standard errors as if what is left were white */
    double rms;                      /**< of what is left, with the degrees of freedom taken off */
} look_regression_t;

/**
 * Least squares of value on columns: column[i][k]. weight: one a row, 0 or more, or NULL. A column that
 * those before it make up to 1e-10 of its square gets 0. false: fewer rows with a weight than columns + 1.
 */
bool look_regress(const double *const *column, size_t columns, const double *value, const double *weight, size_t rows,
                  look_regression_t *result);

/** Largest product of powers of 2, 3 and 5 that is not above n >= 1: what a Fourier transform is fast for. */
size_t look_smooth_length(size_t n);

/** Discrete Fourier transform of `count` real values, sum x_k exp(-2 pi i h k / count), h = 0 .. count / 2, as pairs of
 * real and imaginary part. spectrum: 2 * (count / 2 + 1) numbers. Any count; fast for those above. */
void look_transform(const double *value, size_t count, double *spectrum);

/** Autocovariance sums, sum x_k x_(k + l), of lags 0 .. count - 1, through a transform. */
void look_autocovariance(const double *value, size_t count, double *sums);

/** log10 of the chance that one of `places` independent normal numbers is further than z from 0, to either side. */
double look_log_chance_normal(double z, double places);
/** The same of Student's t with so many degrees of freedom. */
double look_log_chance_student(double t, double degrees, double places);
/** log10 of the chance that in one of `places` so many of `all` or more happen, each with probability p: at most that
 * (Chernoff's bound). all > 0. */
double look_log_chance_binomial(double some, double all, double p, double places);

#endif
