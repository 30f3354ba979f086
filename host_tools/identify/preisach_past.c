/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "identify/preisach_past.h"
#include <math.h>
#include <string.h>

enum { GRID = 8, MOST_SAMPLES = 300, MOST_ROUNDS = 100 };

typedef struct {
    const preisach_grid_t *grid;
    const preisach_fit_t *fit;
    const preisach_span_t *span;
    size_t end, stride;
    double least, best_v[PREISACH_PAST];
} search_t;

static double error_of(const search_t *search, size_t past, const double *past_v) {
    preisach_span_t span = *search->span;
    preisach_memory_t memory;
    double sum = 0.0;
    span.past = past;
    span.past_v = past_v;
    preisach_span_begin(search->grid, &span, &memory);
    for (size_t k = 0; k < search->end; k++) {
        preisach_memory_move(&memory, search->grid, span.recording->column[COLUMN_DRIVE][k]);
        if (k % search->stride == 0) {
            sum += fabs(span.recording->column[COLUMN_DISPLACEMENT][k] -
                        preisach_output(search->grid, search->fit->everett_um, search->fit->offset_um, &memory));
        }
    }
    return sum;
}

static bool take_better(search_t *search, const double past_v[PREISACH_PAST]) {
    const double error = error_of(search, PREISACH_PAST, past_v);
    if (error >= search->least) {
        return false;
    }
    search->least = error;
    memcpy(search->best_v, past_v, sizeof search->best_v);
    return true;
}

static void search_grid(search_t *search, const double range_v[2]) {
    double past_v[PREISACH_PAST];
    for (size_t k = 0; k < GRID * GRID * GRID; k++) {
        size_t digits = k;
        for (size_t p = 0; p < PREISACH_PAST; p++) {
            past_v[p] = range_v[0] + (range_v[1] - range_v[0]) * (double)(digits % GRID) / (GRID - 1);
            digits /= GRID;
        }
        take_better(search, past_v);
    }
}

/* Each drive alone, and with those after it, up and down: alone it may be stuck on the next one. */
static bool search_around(search_t *search, const double range_v[2], double step_v) {
    bool better = false;
    for (size_t k = 0; k < 4 * PREISACH_PAST; k++) {
        const size_t first = k / 4, last = k % 4 < 2 ? first : PREISACH_PAST - 1;
        double past_v[PREISACH_PAST];
        memcpy(past_v, search->best_v, sizeof past_v);
        for (size_t p = first; p <= last; p++) {
            past_v[p] = fmax(range_v[0], fmin(range_v[1], past_v[p] + (k % 2 == 0 ? step_v : -step_v)));
        }
        better = take_better(search, past_v) || better;
    }
    return better;
}

bool preisach_find_past(const preisach_grid_t *grid, const preisach_fit_t *fit, const preisach_span_t *span, size_t end,
                        const double range_v[2], double past_v[PREISACH_PAST]) {
    search_t search = {
        .grid = grid, .fit = fit, .span = span, .end = end, .stride = end / MOST_SAMPLES + 1, .least = HUGE_VAL};
    const double width_v = range_v[1] - range_v[0];
    double step_v = width_v / (2 * GRID);
    search_grid(&search, range_v);
    for (int round = 0; round < MOST_ROUNDS && step_v > 1e-4 * width_v; round++) {
        step_v *= search_around(&search, range_v, step_v) ? 1.0 : 0.5;
    }
    if (search.least >= error_of(&search, span->past, span->past_v)) {
        return false;
    }
    memcpy(past_v, search.best_v, sizeof search.best_v);
    return true;
}
