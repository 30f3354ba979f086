/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Golden-section search for the minimum of a function that has a single one in an interval. */
#ifndef GOLDEN_SECTION_H
#define GOLDEN_SECTION_H

#include <stdbool.h>

/** Sets *value to the function at x. Returns false if it cannot be evaluated. */
typedef bool golden_function_t(void *context, double x, double *value);

/** Shrinks [low, high] by 0.618 a step. *x is then the middle of the last interval. Returns false as soon as the
 * function does. */
bool golden_section(golden_function_t *function, void *context, double low, double high, int steps, double *x);

#endif
