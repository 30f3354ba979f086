/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "page/plot_band.h"
#include "base/failure.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Below this height, in pixels, a column looks like a line whatever passes in it. */
static const double least_height = 1.5;
/* Passes of a column's height. Fewer can still be followed by eye. */
static const double least_passes = 4.0;
/* Part of the cells of two pixels between a spread's edges that its line touches. */
static const double least_filled = 0.4;

enum { CELL = 2 /* pixels */ };

/* What the trace does in each column: its extremes, the length of its way up and down, and the cells it touches. */
typedef struct {
    double left, top;
    size_t columns, cells;
    double *least, *most, *way;
    unsigned char *touched; /* columns x cells */
} cover_t;

static size_t limited(double value, size_t count) {
    return value < 0.0 ? 0 : value >= (double)count ? count - 1 : (size_t)value;
}

static void touch(cover_t *cover, size_t column, double y) {
    cover->least[column] = fmin(cover->least[column], y);
    cover->most[column] = fmax(cover->most[column], y);
    cover->touched[column * cover->cells + limited((y - cover->top) / CELL, cover->cells)] = 1;
}

static void cover_points(cover_t *cover, const double *x, const double *y, size_t count) {
    for (size_t k = 0; k < count; k++) {
        const size_t here = limited(x[k] - cover->left, cover->columns);
        touch(cover, here, y[k]);
        if (k == 0) {
            continue;
        }
        const size_t before = limited(x[k - 1] - cover->left, cover->columns);
        if (before == here) {
            cover->way[here] += fabs(y[k] - y[k - 1]);
        }
        /* A line between two points passes the columns between them, too. */
        const size_t first = before < here ? before : here, last = before < here ? here : before;
        for (size_t c = first + 1; c < last; c++) {
            const double at = cover->left + (double)c + 0.5;
            touch(cover, c, y[k - 1] + (y[k] - y[k - 1]) * (at - x[k - 1]) / (x[k] - x[k - 1]));
        }
    }
}

/* Whether the trace passes more than half of its columns often enough. */
static bool passes(const cover_t *cover) {
    size_t seen = 0, dense = 0;
    for (size_t c = 0; c < cover->columns; c++) {
        const double height = cover->most[c] - cover->least[c];
        seen += height >= 0.0 ? 1 : 0;
        dense += height > least_height && cover->way[c] > least_passes * height ? 1 : 0;
    }
    return 2 * dense > seen;
}

/* Whether its line touches most of what lies between its edges. */
static bool fills(const cover_t *cover) {
    double touched = 0.0, between = 0.0;
    for (size_t c = 0; c < cover->columns; c++) {
        between += fmax(0.0, cover->most[c] - cover->least[c]);
        for (size_t cell = 0; cell < cover->cells; cell++) {
            touched += cover->touched[c * cover->cells + cell] * CELL;
        }
    }
    return touched > least_filled * between;
}

static bool rises(const double *x, size_t count) {
    size_t k = 1;
    while (k < count && x[k] >= x[k - 1]) {
        k++;
    }
    return k >= count;
}

bool plot_band(const double *x, const double *y, size_t count, const double frame[4], bool spread, plot_band_t *band) {
    const size_t columns = (size_t)fmax(1.0, ceil(frame[2] - frame[0]));
    const size_t cells = (size_t)fmax(1.0, ceil((frame[3] - frame[1]) / CELL));
    memset(band, 0, sizeof *band);
    const bool over_time = rises(x, count);
    if (count < 4 * columns || !(over_time || spread)) {
        return false;
    }
    cover_t cover = {.left = frame[0],
                     .top = frame[1],
                     .columns = columns,
                     .cells = cells,
                     .least = allocate(columns, sizeof(double)),
                     .most = allocate(columns, sizeof(double)),
                     .way = allocate(columns, sizeof(double)),
                     .touched = allocate(columns * cells, 1)};
    double *at = allocate(columns, sizeof *at);
    size_t seen = 0;
    for (size_t c = 0; c < columns; c++) {
        cover.least[c] = HUGE_VAL;
        cover.most[c] = -HUGE_VAL;
    }
    cover_points(&cover, x, y, count);
    const bool dense = over_time ? passes(&cover) : fills(&cover);
    for (size_t c = 0; c < columns; c++) {
        if (cover.least[c] <= cover.most[c]) {
            at[seen] = frame[0] + (double)c + 0.5;
            cover.least[seen] = cover.least[c];
            cover.most[seen++] = cover.most[c];
        }
    }
    free(cover.way);
    free(cover.touched);
    *band = (plot_band_t){seen, at, cover.least, cover.most};
    if (!dense) {
        plot_band_free(band);
    }
    return dense;
}

void plot_band_free(plot_band_t *band) {
    free(band->at);
    free(band->top);
    free(band->bottom);
    memset(band, 0, sizeof *band);
}
