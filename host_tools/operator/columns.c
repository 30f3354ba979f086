/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "operator/columns.h"
#include "base/failure.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The largest play needs the whole range; beyond it there is only the past. Small loops need small thresholds: they
 * stand closer together there. */
static const double largest_threshold = 0.98, crowding = 1.5;
/* Lengths of the leaks, in half ranges. */
static const double shortest = 0.02, longest = 4.0;

/* Columns of one recording: its offset, and what its past may have left. */
enum { PER_RECORDING = 1 + 2 * OPERATOR_EXTREMES + OPERATOR_LEAKS };

/* Where each kind of column begins, behind those of the recordings. */
enum {
    LINE = 0,
    CURVE = 1,
    PLAYS = CURVE + OPERATOR_CURVES,
    BENDS = PLAYS + OPERATOR_PLAYS,
    LEAKS = BENDS + OPERATOR_NODES * OPERATOR_DEGREES,
    PRODUCTS = LEAKS + OPERATOR_LEAKS,
    DRAWN = PRODUCTS + OPERATOR_MULTIPLIED * OPERATOR_PRODUCTS,
    PULLED = DRAWN + OPERATOR_POWERS * OPERATOR_DRAWN,
    SHARED = PULLED + OPERATOR_DRAWN /* the law's are behind */
};

/* Every second leak, from the second on, has products. */
static size_t multiplied(size_t index) {
    return 2 + 2 * index;
}

void operator_create(operator_t *operator, const double range_v[2], size_t recordings) {
    memset(operator, 0, sizeof *operator);
    operator->middle_v =(range_v[0] + range_v[1]) / 2.0;
    operator->half_v =(range_v[1] - range_v[0]) / 2.0;
    operator->recordings = recordings;
    operator->columns = recordings * PER_RECORDING + SHARED;
    for (size_t i = 0; i < OPERATOR_PLAYS; i++) {
        const double part = (double)(i + 1) / OPERATOR_PLAYS, node = part * (OPERATOR_NODES - 1);
        operator->threshold[i] = largest_threshold * pow(part, crowding);
        operator->node[i] = node<OPERATOR_NODES - 1 ? (size_t)node : OPERATOR_NODES - 2;
        operator->node_share[i] = node -(double) operator->node[i];
    }
    for (size_t i = 0; i < OPERATOR_LEAKS; i++) {
        operator->rate[i] = 1.0 /(shortest *pow(longest / shortest, (double)i / (OPERATOR_LEAKS - 1)));
    }
}

void operator_drop_law(operator_t *operator) {
    if (operator->has_law) {
        operator->has_law = false;
        operator->columns -= OPERATOR_LAW;
    }
}

void operator_free(operator_t *operator) {
    free(operator->table);
    operator->table = NULL;
}

void operator_set_law(operator_t *operator, const duhem_law_t * law) {
    if (operator->table == NULL) {
        operator->table = allocate(1 + DUHEM_NUMBERS, sizeof(duhem_table_t));
    }
    operator->columns += operator->has_law ? 0 : OPERATOR_LAW;
    operator->has_law = true;
    operator->law = * law;
    duhem_tabulate(law, &operator->table[0]);
    for (size_t i = 0; i < DUHEM_NUMBERS; i++) {
        duhem_law_t next = *law;
        next.number[i] += operator_law_step;
        duhem_tabulate(&next, &operator->table[1 + i]);
    }
}

size_t operator_offset_column(size_t recording) {
    return recording * PER_RECORDING;
}

size_t operator_law_column(const operator_t *operator) {
    return operator->recordings * PER_RECORDING + SHARED;
}

/* An even group stands before its odd one. */
static operator_group_t group_of(operator_group_t even, bool is_odd) {
    return (operator_group_t)((int)even + (is_odd ? 1 : 0));
}

operator_group_t operator_group(const operator_t *operator, size_t column) {
    if (column < operator->recordings * PER_RECORDING) {
        const size_t at = column % PER_RECORDING;
        return at == 0 ? GROUP_FREE : at <= 2 * OPERATOR_EXTREMES ? GROUP_PAST_EXTREMES : GROUP_PAST_PATH;
    }
    const size_t at = column - operator->recordings * PER_RECORDING;
    return at < CURVE                          ? GROUP_FREE
           : at < PLAYS                        ? group_of(GROUP_CURVE, (at - CURVE) % 2 == 1)
           : at < PLAYS + OPERATOR_SMALL_PLAYS ? GROUP_SMALL_PLAYS
           : at < BENDS                        ? GROUP_PLAYS
           : at < LEAKS                        ? (operator_group_t)(GROUP_BENDS + (at - BENDS) / OPERATOR_NODES)
           : at < PRODUCTS                     ? GROUP_LEAKS
           : at < DRAWN                        ? group_of(GROUP_PRODUCTS, (at - PRODUCTS) % 2 == 1)
           : at < PULLED                       ? group_of(GROUP_DRAWN, (at - DRAWN) / OPERATOR_DRAWN % 2 == 0)
           : at < SHARED                       ? GROUP_PULLED
           : at < SHARED + OPERATOR_LAW_CURVES ? group_of(GROUP_LAW, (at - SHARED) % 2 == 0)
                                               : GROUP_LAW_NUMBERS;
}

void operator_begin(operator_walk_t *walk, const operator_t *operator, size_t recording, double first_v,
                    const double range_v[2]) {
    memset(walk, 0, sizeof *walk);
    walk->operator= operator;
    walk->recording = recording;
    walk->u = walk->highest = walk->lowest = operator_level(operator, first_v);
    for (int i = 0; i < 2; i++) {
        walk->range[i] = operator_level(operator, range_v[i]);
    }
    for (size_t i = 0; i < OPERATOR_PLAYS; i++) { /* demagnetised in the middle */
        const double r = operator->threshold[i];
        walk->play[i] = fmax(walk->u - r, fmin(walk->u + r, 0.0));
    }
    for (size_t i = 0; i < OPERATOR_LEAKS; i++) {
        walk->faded[i] = 1.0;
    }
    for (size_t i = 0; operator->has_law && i <= DUHEM_NUMBERS; i++) {
        duhem_begin(&operator->table[i], &walk->law[i]);
    }
}

/* Times 1 / L: the exact solution for a straight way. kept: of the leaks. */
static void move_drawn(operator_walk_t *walk, double u, double sign, const double *kept) {
    for (size_t i = 0; i < OPERATOR_DRAWN; i++) {
        const double length = sign / walk->operator->rate[2 * i + 1];
        double from = 1.0, to = 1.0, from_power = 1.0, to_power = 1.0; /* what it would be after a long way */
        for (size_t k = 0; k < OPERATOR_POWERS; k++) {
            from_power *= walk->u;
            to_power *= u;
            from = from_power - (double)(k + 1) * length * from;
            to = to_power - (double)(k + 1) * length * to;
            walk->drawn[k][i] = to + (walk->drawn[k][i] - from) * kept[2 * i + 1];
        }
    }
}

/* The exact solution for a straight way as well. kept: of the leaks. */
static void move_pulled(operator_walk_t *walk, double u, double sign, const double *kept) {
    for (size_t i = 0; i < OPERATOR_DRAWN; i++) {
        const double rate = walk->operator->rate[2 * i + 1];
        const double ahead = sign * (walk->u - walk->pulled[i]), now = sign * (u - walk->pulled[i]);
        if (now > 0.0) {
            const double left = ahead >= 0.0 ? (1.0 - rate * ahead) * kept[2 * i + 1] : exp(-rate * now);
            walk->pulled[i] = u - sign * (1.0 - left) / rate;
        }
    }
}

void operator_move(operator_walk_t *walk, double drive_v) {
    const operator_t *operator= walk->operator;
    const double u = operator_level(operator, drive_v), du = u - walk->u, way = fabs(du);
    if (way == 0.0) {
        return;
    }
    for (size_t i = 0; i < OPERATOR_PLAYS; i++) {
        const double low = u - operator->threshold[i], high = u + operator->threshold[i];
        double p = walk->play[i];
        p = p < low ? low : p;
        walk->play[i] = p > high ? high : p;
    }
    double kept[OPERATOR_LEAKS];
    const double sign = copysign(1.0, du);
    for (size_t i = 0; i < OPERATOR_LEAKS; i++) {
        const double end = sign / operator->rate[i];
        kept[i] = exp(-way * operator->rate[i]);
        walk->leak[i] = end + (walk->leak[i] - end) * kept[i];
        walk->faded[i] *= kept[i];
    }
    move_drawn(walk, u, sign, kept);
    move_pulled(walk, u, sign, kept);
    for (size_t i = 0; operator->has_law && i <= DUHEM_NUMBERS; i++) {
        duhem_move(&operator->table[i], &walk->law[i], du);
    }
    walk->u = u;
    walk->highest = fmax(walk->highest, u);
    walk->lowest = fmin(walk->lowest, u);
}

/* Hats over evenly spaced nodes from 0 (which has none) to 1. */
static void hats(double part, size_t nodes, double *row) {
    const double at = part * (double)nodes;
    for (size_t i = 0; i < nodes; i++) {
        const double hat = 1.0 - fabs(at - (double)(i + 1));
        row[i] = hat > 0.0 ? hat : 0.0;
    }
}

static double reached(double from, double now, double to) {
    return to != from ? (now - from) / (to - from) : 0.0;
}

static void past_of(const operator_walk_t *walk, double *row) {
    /* highest - lowest grows from 0: each is measured from where the recording began, which is highest - what it has
     * risen. */
    hats(reached(walk->range[0], walk->lowest, walk->range[1]), OPERATOR_EXTREMES, row);
    hats(reached(walk->range[0], walk->highest, walk->range[1]), OPERATOR_EXTREMES, row + OPERATOR_EXTREMES);
    memcpy(row + 2 * OPERATOR_EXTREMES, walk->faded, sizeof walk->faded);
}

/* Rows whose bends are made together: each play's polynomials of all of them at once. */
enum { TOGETHER = 8 };

/* What the bends are polynomials of, in parts of the play. */
static double bend_scale(const operator_t *operator, size_t play) {
    return 1.0 / (1.0 - operator->threshold[play] + 0.05);
}

/* Of one play's polynomials, what the two nodes beside its threshold have. */
static void add_bends(const double *restrict q, double upper, double (*restrict below)[OPERATOR_NODES][TOGETHER]) {
    double now[TOGETHER], before[TOGETHER];
    for (size_t l = 0; l < TOGETHER; l++) {
        before[l] = 1.0;
        now[l] = q[l];
    }
    for (size_t degree = 0; degree < OPERATOR_DEGREES; degree++) {
        double *restrict low = below[degree][0], *restrict high = below[degree][1];
        for (size_t l = 0; l < TOGETHER; l++) {
            const double next = 2.0 * q[l] * now[l] - before[l], part = upper * next;
            before[l] = now[l];
            now[l] = next;
            low[l] += next - part;
            high[l] += part;
        }
    }
}

static void bends_together(const operator_t *operator, double * const * row) {
    double sum[OPERATOR_DEGREES][OPERATOR_NODES][TOGETHER] = {0};
    for (size_t i = 0; i < OPERATOR_PLAYS; i++) {
        double q[TOGETHER];
        const double scale = bend_scale(operator, i);
        for (size_t l = 0; l < TOGETHER; l++) {
            q[l] = row[l][PLAYS + i] * scale;
        }
        add_bends(q, operator->node_share[i],
                  (double(*)[OPERATOR_NODES][TOGETHER]) & sum[0][operator->node[i]]);
    }
    for (size_t l = 0; l < TOGETHER; l++) {
        for (size_t i = 0; i < OPERATOR_DEGREES * OPERATOR_NODES; i++) {
            row[l][BENDS + i] = sum[i / OPERATOR_NODES][i % OPERATOR_NODES][l];
        }
    }
}

void operator_bends(const operator_t *operator, double * row, size_t rows) {
    double *shared[TOGETHER];
    for (size_t from = 0; from < rows; from += TOGETHER) {
        for (size_t l = 0; l < TOGETHER; l++) { /* the last one again, where there are no more */
            const size_t r = from + l < rows ? from + l : rows - 1;
            shared[l] = row + r * operator->columns + operator->recordings * PER_RECORDING;
        }
        bends_together(operator, shared);
    }
}

static void law_of(const operator_walk_t *walk, double *row) {
    const duhem_table_t *table = walk->operator->table;
    const double h = duhem_value(&table[0], &walk->law[0]);
    row[LAW_H] = h;
    row[LAW_H_SQUARE] = h * h;
    row[LAW_H_CUBE] = h * h * h;
    row[LAW_H_U] = h * walk->u;
    for (size_t i = 0; i < DUHEM_NUMBERS; i++) {
        row[OPERATOR_LAW_CURVES + i] = (duhem_value(&table[1 + i], &walk->law[1 + i]) - h) / operator_law_step;
    }
}

void operator_row(const operator_walk_t *walk, double level_v, double *row) {
    operator_row_but_bends(walk, level_v, row);
    operator_bends(walk->operator, row, 1);
}

/* All columns that may differ from 0 but those of the plays and of their bends. */
static void row_but_plays(const operator_walk_t *walk, double level_v, double *row) {
    const operator_t *operator= walk->operator;
    double *mine = row + walk->recording * PER_RECORDING, *shared = row + operator->recordings * PER_RECORDING;
    mine[0] = 1.0;
    past_of(walk, mine + 1);
    const double u = operator_level(operator, level_v);
    double before = 1.0, now = u;
    shared[LINE] = u;
    for (size_t i = 0; i < OPERATOR_CURVES; i++) {
        const double next = 2.0 * u * now - before;
        before = now;
        shared[CURVE + i] = now = next;
    }
    memcpy(shared + LEAKS, walk->leak, sizeof walk->leak);
    for (size_t i = 0; i < OPERATOR_MULTIPLIED; i++) {
        const double z = walk->leak[multiplied(i)] * operator->rate[multiplied(i)];
        double *product = shared + PRODUCTS + i * OPERATOR_PRODUCTS;
        product[0] = z * z;
        product[1] = z * z * z;
        product[2] = z * walk->u;
        product[3] = z * z * walk->u;
    }
    memcpy(shared + DRAWN, walk->drawn, sizeof walk->drawn);
    memcpy(shared + PULLED, walk->pulled, sizeof walk->pulled);
    if (operator->has_law) {
        law_of(walk, shared + SHARED);
    }
}

void operator_row_but_bends(const operator_walk_t *walk, double level_v, double *row) {
    const size_t recordings = walk->operator->recordings * PER_RECORDING;
    memset(row, 0, recordings * sizeof *row);
    row_but_plays(walk, level_v, row);
    memcpy(row + recordings + PLAYS, walk->play, sizeof walk->play);
}

void operator_fold(const operator_t *operator, const double * weight, operator_folded_t *folded) {
    const double *shared = weight + operator->recordings * PER_RECORDING;
    *folded = (operator_folded_t){.operator= operator, .weight = weight };
    for (size_t i = 0; i < OPERATOR_PLAYS; i++) {
        const double upper = operator->node_share[i];
        folded->scale[i] = bend_scale(operator, i);
        folded->bend[0][i] = shared[PLAYS + i] / folded->scale[i];
        for (size_t d = 0; d < OPERATOR_DEGREES; d++) {
            const double *node = shared + BENDS + d * OPERATOR_NODES + operator->node[i];
            folded->bend[1 + d][i] = (1.0 - upper) * node[0] + upper * node[1];
        }
    }
}

/* Of all plays and their bends: Clenshaw's sum of Chebyshev polynomials. */
static double value_of_plays(const operator_folded_t *folded, const double *restrict play) {
    double sum[TOGETHER] = {0.0};
    for (size_t i = 0; i < OPERATOR_PLAYS; i += TOGETHER) {
        double q[TOGETHER], now[TOGETHER], before[TOGETHER];
        for (size_t l = 0; l < TOGETHER; l++) {
            q[l] = play[i + l] * folded->scale[i + l];
            before[l] = 0.0;
            now[l] = folded->bend[OPERATOR_DEGREES][i + l];
        }
        for (size_t d = OPERATOR_DEGREES; d-- > 0;) {
            for (size_t l = 0; l < TOGETHER; l++) {
                const double next = 2.0 * q[l] * now[l] - before[l] + folded->bend[d][i + l];
                before[l] = now[l];
                now[l] = next;
            }
        }
        for (size_t l = 0; l < TOGETHER; l++) {
            sum[l] += q[l] * now[l] - before[l];
        }
    }
    return ((sum[0] + sum[1]) + (sum[2] + sum[3])) + ((sum[4] + sum[5]) + (sum[6] + sum[7]));
}

static double dot(const double *restrict one, const double *restrict other, size_t count) {
    double sum = 0.0;
    for (size_t i = 0; i < count; i++) {
        sum += one[i] * other[i];
    }
    return sum;
}

double operator_value(const operator_folded_t *folded, const operator_walk_t *walk, double level_v, double *row) {
    const operator_t *operator= walk->operator;
    const size_t own = walk->recording * PER_RECORDING, shared = operator->recordings * PER_RECORDING;
    row_but_plays(walk, level_v, row);
    return dot(row + own, folded->weight + own, PER_RECORDING) + dot(row + shared, folded->weight + shared, PLAYS) +
           value_of_plays(folded, walk->play) +
           dot(row + shared + LEAKS, folded->weight + shared + LEAKS, operator->columns - shared - LEAKS);
}
