/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Values between samples. */
#ifndef BETWEEN_H
#define BETWEEN_H

#include <stddef.h>

/** The value at a place between samples: a cubic through the four around it, a line at the ends. 0 <= at <= samples -
 * 1. */
double value_between(const double *value, size_t samples, double at);

/** Of white noise, what that cubic leaves of its variance, at this part of the way from one sample to the next. */
double value_between_variance(double part);

#endif
