/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * A first-order noise with white noise on top, as a filter:
 *
 *     x[k] = memory x[k-1] + e[k] - mix e[k-1],     0 <= mix/memory < 1,     e: independent
 */
#ifndef NOISE_FILTER_H
#define NOISE_FILTER_H

#include "numerics/basis.h"

typedef struct {
    double memory, mix;
} noise_filter_t;

enum { NOISE_FILTER_NUMBERS = 2 };

/** The filter from two numbers without bounds, for a search; and back, away from the ends. */
noise_filter_t noise_filter_at(const double numbers[NOISE_FILTER_NUMBERS]);
void noise_filter_numbers(const noise_filter_t *filter, double numbers[NOISE_FILTER_NUMBERS]);

/** Variance of x, in parts of e's. */
double noise_filter_gain(const noise_filter_t *filter);
/** Power of x at a frequency, in parts of the sample rate, over that of e. */
double noise_filter_power(const noise_filter_t *filter, double turns);

/** e of a piece of x. Its first sample stands for all that was before, and is made as small as e is. */
void noise_filter_whiten(const noise_filter_t *filter, const double *x, size_t length, double *white);

/** Noise that columns have taken their part of. */
typedef struct {
    size_t pieces;             /**< of the rows, those that count; what the noise was in another one is not known */
    const size_t *begin, *end; /**< of each */
    basis_t explained;         /**< the columns */
    double *left;              /**< what they leave: rows */
} explained_noise_t;

/**
 * The filter, from a first one, by the likelihood of what is beyond the columns' reach (restricted likelihood,
 * Patterson and Thompson 1971). Of a slow noise a few columns take most, and what they leave looks smaller and quicker
 * than the noise was. In few long pieces by frequency (noise_bands.h), else sample by sample. Returns the variance of
 * e; 0 where the columns cannot be distinguished in these rows, and then the filter stays what it was.
 */
double noise_filter_restricted(const explained_noise_t *noise, size_t count, noise_filter_t *filter);

#endif
