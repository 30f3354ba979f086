/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * The Preisach model in Everett form on a grid of levels, in double precision: what block `preisach`, its
 * identification and its compilation share. docs/MODELS.md, section 7.
 *
 * E(alpha, beta), the change of the output when the drive rises from beta to alpha, is tabled at pairs of levels, row
 * by row: E(1,0); E(2,0), E(2,1); ... Between levels it is bilinear in squares and linear in the triangles on the
 * diagonal. Outside the levels there are no relays: the position goes on straight, with the slope of the outermost
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
/** The part of it that is in relays without width, the triangles on the diagonal: from_v to to_v in steps that are so
 * small that no other relay switches and returns. */
double preisach_reversible(const preisach_grid_t *grid, const double *table, double to_v, double from_v);

/** More reversals than this, nested in each other, forget the two neighbours between which the drive differs least. */
#define PREISACH_MAX_REVERSALS 500

/** The unforgotten reversals: a maximum, a minimum, a maximum ... each within the one two before it. */
typedef struct {
    size_t reversals;
    double reversal_v[PREISACH_MAX_REVERSALS];
    double drive_v;
} preisach_memory_t;

/** All relays down: the drive at the lowest level, no reversals. */
void preisach_memory_begin(preisach_memory_t *memory, const preisach_grid_t *grid);
/** A swing over all levels whose reversals come closer by one level each until they meet in the middle. */
void preisach_memory_demagnetise(preisach_memory_t *memory, const preisach_grid_t *grid);
/** The drive moves there. */
void preisach_memory_move(preisach_memory_t *memory, const preisach_grid_t *grid, double drive_v);

/** Output at the present memory. offset_um: mean of the outputs at the two outermost levels. */
double preisach_output(const preisach_grid_t *grid, const double *table, double offset_um,
                       const preisach_memory_t *memory);
/** Where a drive lies among the levels: the interval, and how much of it is passed. */
typedef struct {
    double drive_v, part;
    size_t interval;
} preisach_place_t;
/** What the branches that have ended add up to, and where the last one began: they stay while the drive moves on it.
 * Zeroed: nothing known. */
typedef struct {
    bool begun;
    preisach_place_t from;
    size_t known;
    double reversal_v[PREISACH_MAX_REVERSALS], sum[PREISACH_MAX_REVERSALS];
} preisach_sums_t;
/** preisach_output, for calls with one table and one memory, one after the other. */
double preisach_output_next(const preisach_grid_t *grid, const double *table, double offset_um,
                            const preisach_memory_t *memory, preisach_sums_t *sums);
/** Adds to row[] the factors with which the elements enter the output: the model is linear in its table. */
void preisach_output_row(const preisach_grid_t *grid, const preisach_memory_t *memory, double *row);

#endif
