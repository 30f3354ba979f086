/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Products of columns under any filter of the noise, by bands of frequency.
 *
 * Whitening multiplies a column's spectrum by the filter's, so that products of whitened columns are sums over
 * frequencies, of products that do not know the filter (Whittle 1953). Summed over bands in which no filter of first
 * order changes much, they are made once; then a filter costs next to nothing. In a long piece: a spectrum takes it for
 * one period, so that the line through its ends (means over a ninety-sixth part) is taken out of all columns before.
 */
#ifndef NOISE_BANDS_H
#define NOISE_BANDS_H

#include "diagnosis/noise/noise_filter.h"
#include <stdbool.h>

typedef struct {
    size_t vectors;        /**< columns, and what they leave behind them */
    bool *taken;           /**< of each: it was a line */
    size_t bands, freedom; /**< freedom: frequencies, each counted twice, less columns that are no line */
    double *turns;         /**< of each band: its middle, in parts of the sample rate */
    double *frequencies;   /**< how many it has, each counted twice: cosine and sine */
    double *product;       /**< of each band, vectors x vectors: the upper half by columns */
} noise_bands_t;

/** Whether the pieces are few and long enough. */
bool noise_bands_suit(const explained_noise_t *noise);
void noise_bands_open(const explained_noise_t *noise, noise_bands_t *bands);
void noise_bands_close(noise_bands_t *bands);

/** Products of all vectors whitened by the filter, the upper half by columns: vectors x vectors. */
void noise_bands_products(const noise_bands_t *bands, const noise_filter_t *filter, double *products);
/** Logarithm of the determinant of the noise's covariance under the filter, in parts of e's variance. */
double noise_bands_determinant(const noise_bands_t *bands, const noise_filter_t *filter);

#endif
