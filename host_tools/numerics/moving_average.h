/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef MOVING_AVERAGE_H
#define MOVING_AVERAGE_H

#include <stddef.h>

/** Replaces each value by the mean of `length` values from it on, 1 <= length <= samples. The last length - 1 values
 * are meaningless afterwards. */
void moving_average(double *values, size_t samples, size_t length);

#endif
