/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * A universal rate-independent operator: columns that together imitate a hysteresis of any shape, linear in their
 * weights.
 *
 * What makes a hysteresis a hysteresis is that its output depends on the path of the drive and not on how fast or when
 * it was travelled. Every column here has that property, so what they cannot imitate together is no hysteresis.
 * The drive u runs over -1 .. 1 (the range of all recordings); the groups are:
 *
 *     offset     one a recording
 *     line       u
 *     curve      Chebyshev polynomials of u, degree 2 to 8
 *     plays      96 play operators, free weights (Prandtl and Ishlinskii)
 *     bends      Chebyshev polynomials, degree 2 to 7, of these plays, smooth over their thresholds: together with the
 *                plays, sum g(r, p_r) is every Preisach operator with a smooth density (Krasnosel'skii and Pokrovskii,
 *                Systems with Hysteresis, 1989, section 38)
 *     leaks      z' = du - |du| z / L for 14 lengths L, 0.02 to 4; with products: what remembers its path and forgets
 *                it by the way it goes (Duhem's laws: Bouc-Wen, Dahl, LuGre ..)
 *     drawn      e' = |du| (u^k - e / L), k = 1 to 5, for 7 of these lengths: what the path draws towards a curve of
 *                the drive (Coleman and Hodgdon)
 *     pulled     e' = (u - e) |du| / L while the drive moves away from e, else 0, for the same 7 lengths: what follows
 *                from behind, and after a turn stays until the drive comes past it (Jiles and Atherton's irreversible
 *                part, J. Magn. Magn. Mater. 61, 1986, without negative slopes)
 *     law        one scalar Duhem law (duhem.h), if one was fitted: h, h^2, h^3, h u and what its numbers change of h
 *     past       functions of the highest and lowest drive so far, and exp(-path / L): what the drive did before the
 *                recording began, and the recording has not undone yet
 *
 * Each group has one prior variance (evidence.h); offset and line are free. A column is odd if it changes its sign with
 * the drive, or even if it does not; no group has both. So a hysteresis whose branches mirror each other needs no even
 * column, and one that is bent behind or before it is not the same as one of another shape.
 */
#ifndef OPERATOR_COLUMNS_H
#define OPERATOR_COLUMNS_H

#include "operator/duhem.h"
#include <stdbool.h>

/** The columns of a law, without those of its numbers: odd and even in turn. */
enum { LAW_H, LAW_H_SQUARE, LAW_H_CUBE, LAW_H_U, OPERATOR_LAW_CURVES };

enum {
    OPERATOR_CURVES = 7,
    OPERATOR_PLAYS = 96,
    OPERATOR_SMALL_PLAYS = 24, /**< of these: thresholds below a tenth of the range or so, with a separate variance */
    OPERATOR_DEGREES = 6,      /**< of the bends, from 2 on */
    OPERATOR_NODES = 12,       /**< of the bends, over the thresholds */
    OPERATOR_LEAKS = 14,
    OPERATOR_MULTIPLIED = 5, /**< leaks that have products */
    OPERATOR_PRODUCTS = 4,   /**< z^2, z^3, z u, z^2 u */
    OPERATOR_DRAWN = 7,      /**< and pulled. Lengths: every second one of the leaks' */
    OPERATOR_POWERS = 5,     /**< of the drive that they are drawn towards */
    OPERATOR_LAW = OPERATOR_LAW_CURVES + DUHEM_NUMBERS,
    OPERATOR_EXTREMES = 10 /**< nodes over the highest drive, and over the lowest */
};

/** Which variance a column's weight has. The bends have one a degree; where a kind has even and odd columns, the even
 * ones' stands before the odd ones'. */
typedef enum {
    GROUP_FREE, /**< offset, line: no prior */
    GROUP_CURVE,
    GROUP_CURVE_ODD,
    GROUP_SMALL_PLAYS,
    GROUP_PLAYS,
    GROUP_BENDS,
    GROUP_LEAKS = GROUP_BENDS + OPERATOR_DEGREES,
    GROUP_PRODUCTS,
    GROUP_PRODUCTS_ODD,
    GROUP_DRAWN,
    GROUP_DRAWN_ODD,
    GROUP_PULLED,
    GROUP_LAW,
    GROUP_LAW_ODD,
    GROUP_LAW_NUMBERS,
    GROUP_PAST_EXTREMES,
    GROUP_PAST_PATH,
    GROUP_COUNT
} operator_group_t;

typedef struct {
    double middle_v, half_v; /**< u = (drive - middle_v) / half_v */
    size_t recordings, columns;
    double threshold[OPERATOR_PLAYS], node_share[OPERATOR_PLAYS]; /**< of the play's bends, to the node above */
    size_t node[OPERATOR_PLAYS];                                  /**< the node below */
    double rate[OPERATOR_LEAKS];                                  /**< 1 / L */
    bool has_law;
    duhem_law_t law;
    duhem_table_t *table; /**< of the law, and of those next to it in each of its numbers */
} operator_t;

/** range_v: lowest and highest drive of all recordings, lowest < highest. */
void operator_create(operator_t *operator, const double range_v[2], size_t recordings);
void operator_free(operator_t *operator);
/** Gives it a Duhem law, or another one in its place. Walks that are under way are void. */
void operator_set_law(operator_t *operator, const duhem_law_t * law);
/** Of a recording: its offset, 1 in its rows and 0 in the others'. */
size_t operator_offset_column(size_t recording);
/** Without a law. */
void operator_drop_law(operator_t *operator);
/** The first of the law's columns, which are the last ones: h, h^2, h^3, h u, and by each of its numbers. */
size_t operator_law_column(const operator_t *operator);
/** By how much a law's numbers differ in the tables next to it. */
static const double operator_law_step = 1e-4;
/** A drive as the operator measures it, u. */
static inline double operator_level(const operator_t *operator, double drive_v) {
    return (drive_v - operator->middle_v) / operator->half_v;
}
/** Of a column: which prior variance its weight shares. */
operator_group_t operator_group(const operator_t *operator, size_t column);

/** The operator on its way along one recording. */
typedef struct {
    const operator_t *operator;
    size_t recording;
    double u, highest, lowest; /**< so far */
    double range[2];           /**< that the recording will reach */
    double play[OPERATOR_PLAYS], leak[OPERATOR_LEAKS], drawn[OPERATOR_POWERS][OPERATOR_DRAWN], pulled[OPERATOR_DRAWN];
    double faded[OPERATOR_LEAKS]; /**< exp(-path / L) */
    duhem_state_t law[1 + DUHEM_NUMBERS];
} operator_walk_t;

/** At the first drive of a recording that will reach range_v. */
void operator_begin(operator_walk_t *walk, const operator_t *operator, size_t recording, double first_v,
                    const double range_v[2]);
/** Moves the hysteretic part to a drive, as between two samples. */
void operator_move(operator_walk_t *walk, double drive_v);
/** The columns here: row has operator->columns elements. level_v: what the curve sees, the drive itself unless the
 * loops are widened (signal_t.slack_v). */
void operator_row(const operator_walk_t *walk, double level_v, double *row);
/** The same without the bends, which operator_bends makes of the plays in it. Several rows at once cost less. */
void operator_row_but_bends(const operator_walk_t *walk, double level_v, double *row);
/** Completes rows that stand one after the other. */
void operator_bends(const operator_t *operator, double * row, size_t rows);

/** The operator's output: weights with those of each play and its bends folded into one polynomial of the play. */
typedef struct {
    const operator_t *operator;
    const double *weight;
    double scale[OPERATOR_PLAYS], bend[1 + OPERATOR_DEGREES][OPERATOR_PLAYS];
} operator_folded_t;

/** Of weights, one a column. All must outlive it. */
void operator_fold(const operator_t *operator, const double * weight, operator_folded_t *folded);
/** The row times the weights, to rounding. row: room for one. */
double operator_value(const operator_folded_t *folded, const operator_walk_t *walk, double level_v, double *row);

#endif
