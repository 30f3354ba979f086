/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/noise/noise_filter.h"
#include "base/failure.h"
#include "base/parallel.h"
#include "diagnosis/noise/noise_bands.h"
#include "numerics/gsl_errors.h"
#include "numerics/least_squares.h"
#include "numerics/simplex.h"
#include <gsl/gsl_linalg.h>
#include <gsl/gsl_math.h>
#include <stdlib.h>
#include <string.h>

/* Nothing slower is noise: its neighbours would be equal, and its size would have no end. */
static const double longest_memory = 0.9995;

noise_filter_t noise_filter_at(const double numbers[NOISE_FILTER_NUMBERS]) {
    const double memory = longest_memory * tanh(numbers[0]);
    return (noise_filter_t){.memory = memory, .mix = memory / (1.0 + exp(-numbers[1]))};
}

void noise_filter_numbers(const noise_filter_t *filter, double numbers[NOISE_FILTER_NUMBERS]) {
    const double part = fmax(0.01, fmin(0.99, filter->memory != 0.0 ? filter->mix / filter->memory : 0.0));
    numbers[0] = atanh(fmax(-0.999, fmin(0.999, filter->memory / longest_memory)));
    numbers[1] = log(part / (1.0 - part));
}

double noise_filter_gain(const noise_filter_t *filter) {
    return 1.0 + gsl_pow_2(filter->memory - filter->mix) / (1.0 - gsl_pow_2(filter->memory));
}

double noise_filter_power(const noise_filter_t *filter, double turns) {
    const double c = cos(2.0 * M_PI * turns);
    return (1.0 - 2.0 * filter->mix * c + gsl_pow_2(filter->mix)) /
           (1.0 - 2.0 * filter->memory * c + gsl_pow_2(filter->memory));
}

/* Where a column is 0 for long, its whitened one would decay through the smallest numbers that there are, with which
 * processors reckon ten times slower, and so would everything that is made of it. So what is smaller than this counts
 * as 0; it is looked for now and then, as a comparison a sample would take as long as the filter. */
static const double vanishes = 1e-200;
enum { NOW_AND_THEN = 64 };

void noise_filter_whiten(const noise_filter_t *filter, const double *x, size_t length, double *white) {
    const double memory = filter->memory, mix = filter->mix, gain = noise_filter_gain(filter);
    double e = x[0] / gain;
    white[0] = x[0] / sqrt(gain);
    for (size_t k = 1; k < length;) {
        const size_t end = length - k < NOW_AND_THEN ? length : k + NOW_AND_THEN;
        for (; k < end; k++) {
            e = x[k] - memory * x[k - 1] + mix * e;
            white[k] = e;
        }
        e = fabs(e) < vanishes ? 0.0 : e;
    }
}

typedef struct {
    const explained_noise_t *noise;
    size_t count, freedom; /* samples less columns */
    double *white;         /* of one noise: its columns and, last, what they leave */
    double *products;      /* of these */
    bool by_bands;         /* there is one noise, */
    noise_bands_t bands;   /* whose products are known for all filters */
} job_t;

/* One of them under one filter. */
typedef struct {
    const job_t *job;
    const explained_noise_t *noise;
    const noise_filter_t *filter;
} whitening_t;

static void whiten_one(void *context, size_t column) {
    const whitening_t *w = context;
    const size_t rows = w->noise->explained.rows;
    const double *x =
        column < w->noise->explained.columns ? w->noise->explained.column + column * rows : w->noise->left;
    double *white = w->job->white + column * rows;
    memset(white, 0, rows * sizeof(double));
    for (size_t piece = 0; piece < w->noise->pieces; piece++) {
        const size_t begin = w->noise->begin[piece];
        noise_filter_whiten(w->filter, x + begin, w->noise->end[piece] - begin, white + begin);
    }
}

/* Adds the logarithm of the determinant of the whitened columns' products, and the square of what they leave. false:
 * this filter makes columns too much alike. */
static bool factorise(const job_t *job, size_t columns, double *determinant, double *square) {
    const size_t n = columns + 1;
    gsl_matrix_view factor = gsl_matrix_view_array(job->products, n, n);
    const bool good = gsl_linalg_cholesky_decomp1(&factor.matrix) == GSL_SUCCESS;
    for (size_t j = 0; good && j < columns; j++) {
        *determinant += 2.0 * log(gsl_matrix_get(&factor.matrix, j, j));
    }
    *square += good ? gsl_pow_2(gsl_matrix_get(&factor.matrix, columns, columns)) : 0.0;
    return good;
}

/* Products of one noise's vectors under a filter. Returns the logarithm of the determinant of the noise's covariance.
 */
static double multiply(const job_t *job, size_t index, const noise_filter_t *filter) {
    const explained_noise_t *noise = &job->noise[index];
    if (job->by_bands) {
        noise_bands_products(&job->bands, filter, job->products);
        return noise_bands_determinant(&job->bands, filter);
    }
    whitening_t whitening = {.job = job, .noise = noise, .filter = filter};
    const size_t n = noise->explained.columns + 1;
    parallel(n, whiten_one, &whitening);
    products_of_columns(job->white, noise->explained.rows, n, 0, job->products);
    return (double)noise->pieces * log(noise_filter_gain(filter));
}

/* Minus twice the logarithm of the likelihood, HUGE_VAL where there is none; the variance of e. */
static double likelihood(const job_t *job, const noise_filter_t *filter, double *variance) {
    double determinant = 0.0, square = 0.0;
    for (size_t i = 0; i < job->count; i++) {
        determinant += multiply(job, i, filter);
        if (!factorise(job, job->noise[i].explained.columns, &determinant, &square)) {
            return HUGE_VAL;
        }
    }
    *variance = square / (double)job->freedom;
    return (double)job->freedom * log(*variance) + determinant;
}

/* Pieces that are hardly longer than the memory do not tell a slow noise from a slower and larger one: how often a
 * filter is expected goes with the root of 1 - memory. */
static double unlikelihood(const double *numbers, void *context) {
    const noise_filter_t filter = noise_filter_at(numbers);
    double ignored;
    return likelihood(context, &filter, &ignored) - log(1.0 - filter.memory);
}

static void open_job(const explained_noise_t *noise, size_t count, job_t *job) {
    size_t room = 0, most = 0;
    *job = (job_t){.noise = noise, .count = count, .by_bands = count == 1 && noise_bands_suit(noise)};
    for (size_t i = 0; i < count; i++) {
        const size_t columns = noise[i].explained.columns, rows = noise[i].explained.rows;
        room = (columns + 1) * rows > room ? (columns + 1) * rows : room;
        most = columns + 1 > most ? columns + 1 : most;
        for (size_t piece = 0; piece < noise[i].pieces; piece++) {
            job->freedom += noise[i].end[piece] - noise[i].begin[piece];
        }
        job->freedom -= columns;
    }
    job->products = allocate(most * most, sizeof(double));
    if (job->by_bands) {
        noise_bands_open(noise, &job->bands);
        job->freedom = job->bands.freedom;
    } else {
        job->white = allocate(room, sizeof(double));
    }
}

static void close_job(job_t *job) {
    if (job->by_bands) {
        noise_bands_close(&job->bands);
    }
    free(job->white);
    free(job->products);
}

double noise_filter_restricted(const explained_noise_t *noise, size_t count, noise_filter_t *filter) {
    enum { MOST_ITERATIONS = 25 };
    job_t job;
    const simplex_job_t simplex = {.function = unlikelihood,
                                   .context = &job,
                                   .dimensions = NOISE_FILTER_NUMBERS,
                                   .step = 0.4,
                                   .size = 0.03,
                                   .most_iterations = MOST_ITERATIONS};
    double numbers[NOISE_FILTER_NUMBERS], variance = 0.0;
    gsl_returns_errors();
    open_job(noise, count, &job);
    noise_filter_numbers(filter, numbers);
    (void)simplex_minimise(&simplex, numbers);
    const noise_filter_t found = noise_filter_at(numbers);
    if (isfinite(likelihood(&job, &found, &variance)) && variance > 0.0) {
        *filter = found;
    } else {
        variance = 0.0;
    }
    close_job(&job);
    return variance;
}
