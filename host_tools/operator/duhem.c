/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "operator/duhem.h"
#include <math.h>

/* The table ends where the rest of the way to 1 no longer shows. */
static const double nearly_there = 1.0 - 1e-6;

static double slope_at(const duhem_law_t *law, double q) {
    const double at = (q + 1.0) / 2.0 * (DUHEM_KNOTS - 1), *knot = law->number + 2;
    const size_t below = at < 0.0 ? 0 : at < DUHEM_KNOTS - 2 ? (size_t)at : DUHEM_KNOTS - 2;
    const double share = at - (double)below, c = knot[below] + share * (knot[below + 1] - knot[below]);
    return q < 1.0 ? pow(1.0 - q, law->number[1]) * exp(c - law->number[0]) : 0.0;
}

/* One step of Runge and Kutta's fourth order method. */
static double advanced(const duhem_law_t *law, double q, double step) {
    const double a = slope_at(law, q), b = slope_at(law, q + step / 2.0 * a), c = slope_at(law, q + step / 2.0 * b),
                 d = slope_at(law, q + step * c);
    return q + step / 6.0 * (a + 2.0 * b + 2.0 * c + d);
}

void duhem_tabulate(const duhem_law_t *law, duhem_table_t *table) {
    /* How far it is to the end: no more than the whole range there and back, beyond which no drive goes. */
    double way = 0.0, q = -1.0;
    const double step = 0.002;
    while (way < 4.0 && q < nearly_there) {
        q = advanced(law, q, step);
        way += step;
    }
    table->step = way / (DUHEM_TABLE - 1);
    q = -1.0;
    for (size_t i = 0; i < DUHEM_TABLE; i++) {
        table->h[i] = q;
        table->slope[i] = slope_at(law, q);
        q = fmin(advanced(law, q, table->step), 1.0);
    }
}

static double value_at(const duhem_table_t *table, double way) {
    const double at = way / table->step;
    if (at >= DUHEM_TABLE - 1) {
        return table->h[DUHEM_TABLE - 1];
    }
    const size_t i = (size_t)at;
    const double t = at - (double)i, d = table->h[i + 1] - table->h[i], a = table->slope[i] * table->step - d,
                 b = d - table->slope[i + 1] * table->step;
    return table->h[i] + t * (d + (1.0 - t) * (a * (1.0 - t) + b * t));
}

static double way_to(const duhem_table_t *table, double h) {
    size_t low = 0, high = DUHEM_TABLE - 1;
    while (high - low > 1) {
        const size_t middle = (low + high) / 2;
        if (table->h[middle] <= h) {
            low = middle;
        } else {
            high = middle;
        }
    }
    double from = 0.0, to = 1.0;
    for (int i = 0; i < 40; i++) {
        const double t = (from + to) / 2.0;
        if (value_at(table, ((double)low + t) * table->step) <= h) {
            from = t;
        } else {
            to = t;
        }
    }
    return ((double)low + from) * table->step;
}

void duhem_begin(const duhem_table_t *table, duhem_state_t *state) {
    *state = (duhem_state_t){.way = way_to(table, 0.0), .sign = 1.0};
}

double duhem_value(const duhem_table_t *table, const duhem_state_t *state) {
    return state->sign * value_at(table, state->way);
}

void duhem_move(const duhem_table_t *table, duhem_state_t *state, double du) {
    if (du * state->sign < 0.0) {
        state->way = way_to(table, -value_at(table, state->way));
        state->sign = -state->sign;
    }
    state->way = fmin(state->way + fabs(du), table->step * (DUHEM_TABLE - 1));
}
