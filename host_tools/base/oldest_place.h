/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Which one goes, of things that are kept in a fixed number of places. */
#ifndef OLDEST_PLACE_H
#define OLDEST_PLACE_H

#include <stdbool.h>
#include <stddef.h>

/** The oldest place whose thing is not wanted; what is made there is the newest then, and wanted. *made: how many
 * things were made, or left where they are because they are wanted. At least one of the places must not be wanted. */
static inline size_t oldest_place(size_t *made, size_t places, bool *wanted) {
    while (wanted[*made % places]) {
        (*made)++;
    }
    const size_t oldest = (*made)++ % places;
    wanted[oldest] = true;
    return oldest;
}

#endif
