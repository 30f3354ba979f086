/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * The Preisach model in Everett form on a grid of levels, in double precision. Shared by block `preisach`, its
 * identification and its compilation. docs/MODELS.md, section 7.
 *
 * E(alpha, beta), the change of the output when the drive rises from beta to alpha, is tabulated at pairs of levels,
 * row by row: E(1,0); E(2,0), E(2,1); ... Between levels it is bilinear in squares and linear in the triangles on the
 * diagonal. Outside the levels there are no relays: the position continues linearly, with the slope of the outermost
 * triangle, and reversals there count as reversals at the last level.
 */
#ifndef PREISACH_GRID_H
#define PREISACH_GRID_H

#include <stdbool.h>
#include <stddef.h>

typedef struct {
    size_t levels;         /**< 2 or more */
    const double *level_v; /**< strictly rising */
} preisach_grid_t;

/** Elements of the table. */
size_t preisach_elements(size_t levels);
/** Index of E(level i, level j), j < i. */
size_t preisach_element(size_t i, size_t j);

/** E(to, from) as a sum of elements times factors: at most four corners and the two straight ends. */
#define PREISACH_MAX_TERMS 6
typedef struct {
    size_t count;
    size_t element[PREISACH_MAX_TERMS];
    double factor[PREISACH_MAX_TERMS];
} preisach_terms_t;

/** The change of the output on a branch that leads directly from one drive to the other; E(from, to) = -E(to, from). */
preisach_terms_t preisach_terms(const preisach_grid_t *grid, double to_v, double from_v);
double preisach_everett(const preisach_grid_t *grid, const double *table, double to_v, double from_v);
/** The reversible part of preisach_everett, from the relays of zero width in the triangles on the diagonal. */
double preisach_reversible(const preisach_grid_t *grid, const double *table, double to_v, double from_v);

/** Most nested reversals; beyond them the adjacent pair with the smallest difference of drive is dropped. */
#define PREISACH_MAX_REVERSALS 500

/** The remembered reversals: a maximum, a minimum, a maximum ... each inside the range of the two before it. */
typedef struct {
    size_t reversals;
    double reversal_v[PREISACH_MAX_REVERSALS];
    double drive_v;
} preisach_memory_t;

/** All relays down: the drive at the lowest level, no reversals. */
void preisach_memory_begin(preisach_memory_t *memory, const preisach_grid_t *grid);
/** What these drives left, one after the other from the lowest level on; of none: demagnetised, by a decaying
 * oscillation over all levels, each reversal one level further in, to the middle. */
void preisach_memory_settle(preisach_memory_t *memory, const preisach_grid_t *grid, const double *past_v, size_t past);
/** Moves the drive to drive_v. */
void preisach_memory_move(preisach_memory_t *memory, const preisach_grid_t *grid, double drive_v);

/** Output at the present memory. offset_um: mean of the outputs at the two outermost levels. */
double preisach_output(const preisach_grid_t *grid, const double *table, double offset_um,
                       const preisach_memory_t *memory);
/** Location of a drive on the grid: the interval, and the fraction of it below the drive. */
typedef struct {
    double drive_v, part;
    size_t interval;
} preisach_place_t;
/** Cached sums over the completed branches, and the start of the last one: valid while the drive stays on it. Zeroed:
 * empty. */
typedef struct {
    bool begun;
    preisach_place_t from;
    size_t known;
    double reversal_v[PREISACH_MAX_REVERSALS], sum[PREISACH_MAX_REVERSALS];
} preisach_sums_t;
/** preisach_output with a cache, for successive calls with the same table and memory. */
double preisach_output_next(const preisach_grid_t *grid, const double *table, double offset_um,
                            const preisach_memory_t *memory, preisach_sums_t *sums);
/** Adds to row[] the factors with which the elements enter the output: the model is linear in its table. */
void preisach_output_row(const preisach_grid_t *grid, const preisach_memory_t *memory, double *row);

#endif
