/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Products of whitened columns by bands of frequency, against those of columns that were whitened sample by sample. */
#include "diagnosis/noise/noise_bands.h"
#include "support.h"
#include "unity.h"
#include <gsl/gsl_cblas.h>
#include <gsl/gsl_math.h>
#include <gsl/gsl_statistics_double.h>
#include <math.h>
#include <stdlib.h>

/* A prime, of which a quick transform takes so many: 2^5 5^4. */
enum { SAMPLES = 20011, QUICK = 20000, WAVES = 6, PIECES = 5 };
static random_t rng;
static basis_t basis;
static double left[SAMPLES];
static const noise_filter_t filters[] = {{0.0, 0.0}, {0.5, 0.1}, {0.9, 0.3}, {0.99, 0.2}, {0.99, 0.8}};
enum { FILTERS = sizeof filters / sizeof filters[0] };

/* A constant, which no spectrum sees; waves, and steps that are held, that come and go; and noise. */
static void open_columns(double memory) {
    double column[SAMPLES], n = random_normal(&rng);
    basis_open(&basis, SAMPLES, WAVES + 2);
    for (size_t j = 0; j < basis.most; j++) {
        for (size_t k = 0; k < SAMPLES; k++) {
            const double turn = 2.0 * M_PI * (double)k / (QUICK - 1);
            const double wave = j <= WAVES ? sin((double)(j * j) * turn) : sin(40.0 * turn + 0.1) > 0.0;
            column[k] = j == 0 ? 1.0 : (1.0 - cos(turn)) * wave;
        }
        basis_add(&basis, column, 1);
    }
    for (size_t k = 0; k < SAMPLES; k++) {
        left[k] = n;
        n = memory * n + sqrt(1.0 - memory * memory) * random_normal(&rng);
    }
}

void setUp(void) {
}

void tearDown(void) {
    basis_close(&basis);
}

/* Less the line through the means of its first and last ninety-sixth part; and less its mean, which is no frequency. */
static void take_line(const double *x, double *left_of_it) {
    enum { END = QUICK / 96 };
    const double first = gsl_stats_mean(x, 1, END), last = gsl_stats_mean(x + QUICK - END, 1, END);
    for (size_t k = 0; k < QUICK; k++) {
        left_of_it[k] = x[k] - first - (last - first) * ((double)k - 0.5 * (END - 1)) / (QUICK - END);
    }
    const double mean = gsl_stats_mean(left_of_it, 1, QUICK);
    for (size_t k = 0; k < QUICK; k++) {
        left_of_it[k] -= mean;
    }
}

static explained_noise_t pieces_of(size_t count, size_t begin[PIECES], size_t end[PIECES]) {
    for (size_t piece = 0; piece < count; piece++) {
        begin[piece] = piece * SAMPLES / count;
        end[piece] = (piece + 1) * SAMPLES / count;
    }
    return (explained_noise_t){.pieces = count, .begin = begin, .end = end, .explained = basis, .left = left};
}

/* 5 %: bands of a sixteenth of an octave, over which the power goes with the square of the frequency at most; a wave at
 * the end of one is weighted like one in its middle. Of the noise itself, whose ends differ, no product is compared.
 */
static void test_products_are_those_of_whitened_columns(void) {
    size_t begin[PIECES], end[PIECES];
    open_columns(0.9);
    const explained_noise_t noise = pieces_of(1, begin, end);
    const size_t n = basis.columns + 1;
    double *white = allocate(n * QUICK, sizeof(double)), *products = allocate(n * n, sizeof(double));
    double line[QUICK];
    noise_bands_t bands;
    TEST_ASSERT_EQUAL_UINT64(WAVES + 2, basis.columns);
    TEST_ASSERT_TRUE(noise_bands_suit(&noise));
    noise_bands_open(&noise, &bands);
    TEST_ASSERT_TRUE(bands.taken[0]);
    for (size_t f = 0; f < FILTERS; f++) {
        noise_bands_products(&bands, &filters[f], products);
        TEST_ASSERT_EQUAL_DOUBLE(1.0, products[0]);
        for (size_t j = 1; j < basis.columns; j++) {
            take_line(basis.column + j * SAMPLES, line);
            noise_filter_whiten(&filters[f], line, QUICK, white + j * QUICK);
            TEST_ASSERT_FALSE(bands.taken[j]);
            TEST_ASSERT_EQUAL_DOUBLE(0.0, products[j * n]);
        }
        for (size_t j = 1; j < basis.columns; j++) {
            const double *one = white + j * QUICK, own = cblas_ddot(QUICK, one, 1, one, 1);
            for (size_t i = 1; i <= j; i++) {
                const double *other = white + i * QUICK, size = sqrt(own * cblas_ddot(QUICK, other, 1, other, 1));
                TEST_ASSERT_DOUBLE_WITHIN(0.05, cblas_ddot(QUICK, one, 1, other, 1) / size, products[j * n + i] / size);
            }
        }
    }
    noise_bands_close(&bands);
    free(white);
    free(products);
}

/* Of all filters of first order the mean logarithm of the power over frequencies is that of e: 0. One cosine in so many
 * frequencies is left out, and bands are as above. */
static void test_the_determinant_is_that_of_independent_noise(void) {
    size_t begin[PIECES], end[PIECES];
    open_columns(0.0);
    const explained_noise_t noise = pieces_of(1, begin, end);
    noise_bands_t bands;
    noise_bands_open(&noise, &bands);
    for (size_t f = 0; f < FILTERS; f++) {
        TEST_ASSERT_DOUBLE_WITHIN(0.002, 0.0, noise_bands_determinant(&bands, &filters[f]) / SAMPLES);
    }
    noise_bands_close(&bands);
}

/* The same noise in one piece, by bands, and in five, sample by sample: what differs are ends, and frequencies that the
 * pieces have not. The size of a noise whose memory is 33 samples is in the lowest 95 of its frequencies, each with two
 * numbers: it is known to 1 / sqrt(2 * 190) = 5 %, and five of these. Of e all 20011 samples speak: 0.5 %. Slower
 * noise: test_diagnosis_noise.c. */
static void test_filters_are_those_of_the_other_way(void) {
    static const double memories[] = {0.6, 0.9, 0.97}, agreement[] = {0.05, 0.1, 0.25};
    for (size_t m = 0; m < 3; m++) {
        size_t begin[PIECES], end[PIECES];
        double rms[2];
        open_columns(memories[m]);
        basis_project(&basis, left, 1);
        for (size_t way = 0; way < 2; way++) {
            const explained_noise_t noise = pieces_of(way == 0 ? 1 : PIECES, begin, end);
            noise_filter_t filter = {memories[m], 0.1 * memories[m]};
            TEST_ASSERT_EQUAL_INT(way == 0, noise_bands_suit(&noise));
            const double variance = noise_filter_restricted(&noise, 1, &filter);
            TEST_ASSERT_TRUE(variance > 0.0);
            rms[way] = sqrt(variance * noise_filter_gain(&filter));
            printf("memory %.2f: %.4f, mix %.4f, size %.4f\n", memories[m], filter.memory, filter.mix, rms[way]);
            TEST_ASSERT_DOUBLE_WITHIN(0.03, 1.0, sqrt(variance / (1.0 - gsl_pow_2(memories[m]))));
        }
        TEST_ASSERT_DOUBLE_WITHIN(agreement[m], 1.0, rms[0] / rms[1]);
        basis_close(&basis);
    }
    open_columns(0.0);
}

int main(void) {
    rng = random_start("diagnosis_noise_bands", 20261122);
    UNITY_BEGIN();
    RUN_TEST(test_products_are_those_of_whitened_columns);
    RUN_TEST(test_the_determinant_is_that_of_independent_noise);
    RUN_TEST(test_filters_are_those_of_the_other_way);
    return UNITY_END();
}
