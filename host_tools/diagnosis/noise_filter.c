/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "noise_filter.h"
#include "failure.h"
#include "gsl_errors.h"
#include "simplex.h"
#include <gsl/gsl_cblas.h>
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

void noise_filter_whiten(const noise_filter_t *filter, const double *x, size_t length, double *white) {
    const double gain = noise_filter_gain(filter);
    double e = x[0] / gain;
    white[0] = x[0] / sqrt(gain);
    for (size_t k = 1; k < length; k++) {
        e = x[k] - filter->memory * x[k - 1] + filter->mix * e;
        white[k] = e;
    }
}

typedef struct {
    const explained_noise_t *noise;
    size_t count, freedom; /* samples less columns */
    double *white;         /* of one noise: its columns and, last, what they leave */
} job_t;

static void whiten_all(const job_t *job, const explained_noise_t *noise, const noise_filter_t *filter) {
    const size_t n = noise->explained.columns, rows = noise->explained.rows;
    for (size_t j = 0; j <= n; j++) {
        const double *column = j < n ? noise->explained.column + j * rows : noise->left;
        double *white = job->white + j * rows;
        memset(white, 0, rows * sizeof(double));
        for (size_t piece = 0; piece < noise->pieces; piece++) {
            const size_t begin = noise->begin[piece];
            noise_filter_whiten(filter, column + begin, noise->end[piece] - begin, white + begin);
        }
    }
}

/* Adds the logarithm of the determinant of the whitened columns' products, and the square of what they leave. false:
 * this filter makes columns too much alike. */
static bool factorise(const job_t *job, const explained_noise_t *noise, double *determinant, double *square) {
    const size_t n = noise->explained.columns, rows = noise->explained.rows;
    gsl_matrix *factor = gsl_matrix_alloc(n + 1, n + 1);
    /* The upper half by columns is the lower one by rows. */
    cblas_dsyrk(CblasColMajor, CblasUpper, CblasTrans, (int)n + 1, (int)rows, 1.0, job->white, (int)rows, 0.0,
                factor->data, (int)n + 1);
    const bool good = gsl_linalg_cholesky_decomp1(factor) == GSL_SUCCESS;
    for (size_t j = 0; good && j < n; j++) {
        *determinant += 2.0 * log(gsl_matrix_get(factor, j, j));
    }
    *square += good ? gsl_pow_2(gsl_matrix_get(factor, n, n)) : 0.0;
    gsl_matrix_free(factor);
    return good;
}

/* Minus twice the logarithm of the likelihood, HUGE_VAL where there is none; the variance of e. */
static double likelihood(const job_t *job, const noise_filter_t *filter, double *variance) {
    double determinant = 0.0, square = 0.0;
    for (size_t i = 0; i < job->count; i++) {
        whiten_all(job, &job->noise[i], filter);
        determinant += (double)job->noise[i].pieces * log(noise_filter_gain(filter));
        if (!factorise(job, &job->noise[i], &determinant, &square)) {
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

double noise_filter_restricted(const explained_noise_t *noise, size_t count, noise_filter_t *filter) {
    enum { MOST_ITERATIONS = 25 };
    job_t job = {.noise = noise, .count = count};
    size_t room = 0;
    for (size_t i = 0; i < count; i++) {
        const size_t columns = noise[i].explained.columns, rows = noise[i].explained.rows;
        room = (columns + 1) * rows > room ? (columns + 1) * rows : room;
        for (size_t piece = 0; piece < noise[i].pieces; piece++) {
            job.freedom += noise[i].end[piece] - noise[i].begin[piece];
        }
        job.freedom -= columns;
    }
    job.white = allocate(room, sizeof(double));
    const simplex_job_t simplex = {.function = unlikelihood,
                                   .context = &job,
                                   .dimensions = NOISE_FILTER_NUMBERS,
                                   .step = 0.4,
                                   .size = 0.03,
                                   .most_iterations = MOST_ITERATIONS};
    double numbers[NOISE_FILTER_NUMBERS], variance = 0.0;
    gsl_returns_errors();
    noise_filter_numbers(filter, numbers);
    (void)simplex_minimise(&simplex, numbers);
    const noise_filter_t found = noise_filter_at(numbers);
    if (isfinite(likelihood(&job, &found, &variance)) && variance > 0.0) {
        *filter = found;
    } else {
        variance = 0.0;
    }
    free(job.white);
    return variance;
}
