/* SPDX-License-Identifier: GPL-3.0-or-later */
/** What would change if one parameter image took the place of another, in units. */
#ifndef IMAGE_DIFFERENCE_H
#define IMAGE_DIFFERENCE_H

#include "hyst/parameters.h"
#include <stddef.h>

typedef struct {
    const char *field; /**< as in hyst/parameters.h */
    const char *unit;  /**< "" for none */
    double before, after;
    size_t differing, count; /**< of a list: how many elements; `before`, `after` differ most. Else 0 */
} image_difference_t;

enum { IMAGE_DIFFERENCES_MOST = 40 };

/** Writes the fields that differ, in the order of the image. Returns how many. Lists of different length differ in
 * every element that one of them lacks. */
size_t image_differences(const hyst_parameters_t *before, const hyst_parameters_t *after,
                         image_difference_t difference[IMAGE_DIFFERENCES_MOST]);

#endif
