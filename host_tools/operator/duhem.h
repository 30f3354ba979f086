/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * A scalar Duhem law: one state that follows the drive by how far it is along its branch.
 *
 *     dh = s f(s h) |du|,   s = sign(du),   f(q) = (1 - q)^power exp(c(q)) / length,   -1 <= q < 1
 *
 * h runs from -1 to 1. c is a line between knots. Bouc and Wen's equation is f(q) = 1 - q^n for q > 0 and flatter for
 * q < 0, Dahl's is (1 - q)^p, LuGre's presliding is p = 1. On a branch h depends on the way alone, so a table of h over
 * the way is the exact solution for steps of any length.
 */
#ifndef OPERATOR_DUHEM_H
#define OPERATOR_DUHEM_H

#include <stddef.h>

enum { DUHEM_KNOTS = 9, DUHEM_NUMBERS = DUHEM_KNOTS + 2, DUHEM_TABLE = 2048 };

/** The numbers of a law: log length, power, c at evenly spaced knots from -1 to 1. */
typedef struct {
    double number[DUHEM_NUMBERS];
} duhem_law_t;

/** h over the way along a branch, from h = -1 on. */
typedef struct {
    double step; /**< way between entries */
    double h[DUHEM_TABLE], slope[DUHEM_TABLE];
} duhem_table_t;

void duhem_tabulate(const duhem_law_t *law, duhem_table_t *table);

typedef struct {
    double way, sign; /**< along the branch (an entry of the table, as a way); direction of the branch */
} duhem_state_t;

/** h = 0 on a rising branch. */
void duhem_begin(const duhem_table_t *table, duhem_state_t *state);
/** Moves by du (not 0). */
void duhem_move(const duhem_table_t *table, duhem_state_t *state, double du);
double duhem_value(const duhem_table_t *table, const duhem_state_t *state);

#endif
