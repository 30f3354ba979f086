/* SPDX-License-Identifier: GPL-3.0-or-later */
/** The step of a converter or of a file, seen in the distinct values of a column. */
#ifndef LOOK_RESOLUTION_H
#define LOOK_RESOLUTION_H

#include <stddef.h>

/**
 * The step of a converter: if all distances of neighbouring distinct values are multiples of one within a tenth of it,
 * and 64 or more values (or a quarter of them) occur again; 0 otherwise. It may be the last digit of the file. It is
 * refined over all levels; its error is then below a thousandth of it.
 */
double resolution_step(const double *value, size_t count);

/**
 * The same of readings. Those with too few levels for that have a step, too, if the drive has many times as many: it
 * moved while the reading stayed. Readings that follow the levels of a staircase are no converter's.
 */
double resolution_step_of_reading(const double *reading, const double *drive, size_t count);

/** 10^-d, d = 0 .. 9, if all values have d digits behind the point and no fewer; 0 if they have more. */
double resolution_digit(const double *value, size_t count);

#endif
