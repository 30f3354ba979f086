/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Cells of time, frequency, drive or its rate, and the ranges of those that hold most of an effect (locate.h). */
#ifndef CELLS_H
#define CELLS_H

#include "diagnosis/where/location.h"

/** What was found in a cell, and where its first and last sample (or frequency) lies. */
typedef struct {
    double energy, from, to;
    double visits; /**< samples in it, where that differs from cell to cell */
    bool chosen;
} cell_t;

/** Chooses the fewest cells that hold most of it. Returns how many, 0 if there is nothing. */
size_t cells_choose(cell_t *cell, size_t count);
/** The same for mean squares, above the floor's, in place of energies: a drive is not equally long in every cell. Cells
 * with hardly any samples say nothing. Whether what was chosen has no place among the others. */
bool cells_have_no_place(cell_t *cell, size_t count, double floor_um);

/** What lies between two ranges: as a difference; as the logarithm of a ratio. */
double cells_linear_gap(const range_t *left, const range_t *right);
double cells_octave_gap(const range_t *left, const range_t *right);
/** The chosen cells as ranges; neighbours, and those with at most `joined` between them, are one. */
void cells_collect(const cell_t *cell, size_t count, double (*gap)(const range_t *, const range_t *), double joined,
                   ranges_t *ranges);
/** The same ranges, but at most so many: the smallest gaps are bridged. */
ranges_t ranges_bridged(const ranges_t *ranges, double (*gap)(const range_t *, const range_t *), size_t most);

#endif
