/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Noise that is white and 1/f: its power over frequency is  variance (1 + rho / f),  f in cycles a sample.
 *
 * The filter that makes it white is a ladder of first-order sections with two zeros a decade, each with its pole half a
 * step above it. That is a slope of 1/2 up to rho, flat beyond, within a fifth (Oustaloup's approximation of a power of
 * s). Its first coefficient is 1, so that the variance of its output is that of one-step predictions, and the filter
 * with the least variance is the likeliest.
 */
#ifndef OPERATOR_PINK_H
#define OPERATOR_PINK_H

#include "numerics/state_space.h"

enum { PINK_SECTIONS = 12 };

typedef struct {
    double rho; /**< where both are equally strong, in cycles a sample; 0: white */
    size_t sections;
    double zero[PINK_SECTIONS], pole[PINK_SECTIONS];
} pink_t;

/** For recordings of up to `samples` samples: what is slower than they are long is left alone. */
void pink_create(pink_t *pink, double rho, size_t samples);
/** Memory of the filter; NULL for white noise. To be freed. */
double *pink_memory(const pink_t *pink);
/** Whitens the next value in place. first: of a recording; as if it were in the steady state. */
void pink_value(const pink_t *pink, double *memory, double *value, int first);

/** The same filter as states, for rows of many columns at once. */
state_space_t pink_states(const pink_t *pink);

#endif
