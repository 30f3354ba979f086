/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/nuisance/smooth_plane.h"
#include "numerics/least_squares.h"
#include "numerics/splines.h"
#include <gsl/gsl_cblas.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MIDDLE_INTERVALS = 3, WIDTH_INTERVALS = 6, DEGREE = 2, FINE_INTERVALS = 80 };
enum { MIDDLES = MIDDLE_INTERVALS + DEGREE, WIDTHS = WIDTH_INTERVALS + DEGREE };

/* Of the whole table: closer, two elements are the same but for rounding. */
static const double same = 1e-9;

size_t smooth_plane_functions(void) {
    return (size_t)MIDDLES * WIDTHS;
}

/* Whether a function is there: of a pair that mirror each other, a symmetric plane has one. */
static bool has_function(bool symmetric, size_t function) {
    return !symmetric || 2 * (function % MIDDLES) < MIDDLES;
}

double smooth_plane_function(const preisach_grid_t *grid, bool symmetric, size_t function, double *value) {
    const size_t last = grid->levels - 1;
    const double center_v = 0.5 * (grid->level_v[0] + grid->level_v[last]);
    const double half_v = 0.5 * (grid->level_v[last] - grid->level_v[0]);
    const size_t m = function % MIDDLES, mirrored = MIDDLES - 1 - m;
    double largest = 0.0;
    if (!has_function(symmetric, function)) {
        return 0.0;
    }
    for (size_t i = 1; i <= last; i++) {
        for (size_t j = 0; j < i; j++) {
            const double high = (grid->level_v[i] - center_v) / half_v, low = (grid->level_v[j] - center_v) / half_v;
            const double width = 0.5 * (high - low), x = 0.5 * (0.5 * (high + low) + 1.0) * MIDDLE_INTERVALS;
            const double along = symmetric ? spline(m, x) + spline(mirrored, x) : spline(m, x);
            const double here = width * along * spline(function / MIDDLES, sqrt(width) * WIDTH_INTERVALS);
            value[preisach_element(i, j)] = here;
            largest = fmax(largest, here);
        }
    }
    return largest;
}

/* Factors of the functions that come nearest to a table. */
static bool nearest(const preisach_grid_t *grid, const double *table, bool symmetric, double *factor,
                    failure_t *failure) {
    const size_t functions = smooth_plane_functions(), elements = preisach_elements(grid->levels);
    double *columns = allocate(functions * elements, sizeof(double));
    for (size_t f = 0; f < functions; f++) {
        smooth_plane_function(grid, symmetric, f, columns + f * elements);
    }
    const bool good = fit_columns(columns, table, elements, functions, NULL, factor, failure);
    free(columns);
    return good;
}

/* The same table between its levels, which are too far apart to tell functions of small widths from each other. */
static void divide(const model_block_t *preisach, const preisach_grid_t *fine, double *table) {
    const parameter_t *levels = model_parameter(preisach, "levels_v");
    const preisach_grid_t grid = {.levels = levels->count, .level_v = levels->value};
    for (size_t i = 1; i < fine->levels; i++) {
        for (size_t j = 0; j < i; j++) {
            table[preisach_element(i, j)] = preisach_everett(&grid, model_parameter(preisach, "everett_um")->value,
                                                             fine->level_v[i], fine->level_v[j]);
        }
    }
}

/* E of a relay and of the one whose switching drives mirror its own. */
static size_t mirror(size_t levels, size_t i, size_t j) {
    return preisach_element(levels - 1 - j, levels - 1 - i);
}

bool smooth_plane_is_symmetric(size_t levels, const double *table) {
    for (size_t i = 1; i < levels; i++) {
        for (size_t j = 0; j < i; j++) {
            if (fabs(table[preisach_element(i, j)] - table[mirror(levels, i, j)]) >
                same * fabs(table[preisach_element(levels - 1, 0)])) {
                return false;
            }
        }
    }
    return true;
}

bool smooth_plane_from(model_block_t *preisach, const double drive_range_v[2], bool symmetric, failure_t *failure) {
    const double low_v = drive_range_v[0], high_v = drive_range_v[1];
    const size_t functions = smooth_plane_functions(), elements = preisach_elements(FINE_INTERVALS + 1);
    double level_v[FINE_INTERVALS + 1];
    double *table = allocate(elements, sizeof(double)), *value = allocate(elements, sizeof(double));
    double *factor = allocate(functions, sizeof(double));
    const preisach_grid_t fine = {.levels = FINE_INTERVALS + 1, .level_v = level_v};
    for (size_t i = 0; i < FINE_INTERVALS; i++) {
        level_v[i] = low_v + (high_v - low_v) * (double)i / FINE_INTERVALS;
    }
    level_v[FINE_INTERVALS] = high_v;
    divide(preisach, &fine, table);
    const bool good = nearest(&fine, table, symmetric, factor, failure);
    if (good) {
        memset(table, 0, elements * sizeof(double));
        for (size_t f = 0; f < functions; f++) {
            smooth_plane_function(&fine, symmetric, f, value);
            cblas_daxpy((int)elements, factor[f], value, 1, table, 1);
        }
        model_set_array(preisach, "levels_v", fine.levels, level_v, NULL);
        model_set_array(preisach, "everett_um", elements, table, NULL);
    }
    free(table);
    free(value);
    free(factor);
    return good;
}
