/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "elements/creep_cells.h"
#include <math.h>

double creep_time_constant_s(double shortest_s, size_t cell) {
    return shortest_s * pow(10.0, (double)cell / CREEP_CELLS_PER_DECADE);
}

creep_cells_t creep_cells(double gamma_per_decade, double shortest_s, double longest_s, double sample_rate_hz) {
    creep_cells_t cells = {.gain = gamma_per_decade / CREEP_CELLS_PER_DECADE};
    const double steps = floor(CREEP_CELLS_PER_DECADE * log10(longest_s / shortest_s) + 0.5);
    cells.cells = (size_t)fmin(steps, CREEP_MAX_CELLS - 1) + 1;
    for (size_t j = 0; j < cells.cells; j++) {
        cells.rate[j] = -expm1(-1.0 / (creep_time_constant_s(shortest_s, j) * sample_rate_hz));
    }
    return cells;
}

double creep_gain_at_rest(const creep_cells_t *cells) {
    return 1.0 + cells->gain * (double)cells->cells;
}

void creep_settle(const creep_cells_t *cells, double *level, double h) {
    for (size_t j = 0; j < cells->cells; j++) {
        level[j] = h;
    }
}

double creep_offset(const creep_cells_t *cells, const double *level) {
    double sum = 0.0;
    for (size_t j = 0; j < cells->cells; j++) {
        sum += level[j];
    }
    return cells->gain * sum;
}

void creep_follow(const creep_cells_t *cells, double *level, double h) {
    for (size_t j = 0; j < cells->cells; j++) {
        level[j] += cells->rate[j] * (h - level[j]);
    }
}
