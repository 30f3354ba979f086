/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "operator/rows.h"
#include "base/failure.h"
#include <stdlib.h>
#include <string.h>

/* Rows of one recording that wait: all of them where the noise remembers, otherwise those that are wanted. */
typedef struct {
    const rows_wanted_t *wanted;
    rows_taker_t *take;
    void *context;
    size_t columns, waiting, count; /* count: of these, wanted */
    bool first;                     /* they begin a recording */
    double *row, *white, *memory;
    size_t taken[PINK_ROWS], sample[PINK_ROWS];
} waiting_t;

static void hand_on(waiting_t *w) {
    if (w->waiting == 0) {
        return;
    }
    operator_bends(w->wanted->operator, w->row, w->waiting);
    if (w->memory == NULL) {
        w->take(w->context, w->row, w->sample, w->count);
    } else {
        pink_rows(w->wanted->noise, w->memory, w->columns, w->row, w->waiting, w->first, w->taken, w->count, w->white);
        if (w->count > 0) {
            w->take(w->context, w->white, w->sample, w->count);
        }
    }
    w->waiting = w->count = 0;
    w->first = false;
}

static inline bool is_wanted(const rows_wanted_t *wanted, size_t at) {
    return (wanted->use[at] == 0) == wanted->unused;
}

void rows_stream(const rows_wanted_t *wanted, rows_taker_t *take, void *context) {
    const size_t n = wanted->operator->columns, sections = wanted->noise->sections;
    waiting_t w = {.wanted = wanted,
                   .take = take,
                   .context = context,
                   .columns = n,
                   .row = allocate(PINK_ROWS * n, sizeof(double)),
                   .white = sections > 0 ? allocate(PINK_ROWS * n, sizeof(double)) : NULL,
                   .memory = sections > 0 ? allocate(sections * n, sizeof(double)) : NULL};
    size_t used = 0;
    for (hike_t hike = hike_begin(wanted->paths, wanted->count, wanted->turns); hike_on(&hike, wanted->operator);) {
        const bool taken = is_wanted(wanted, hike.at) && used++ % wanted->thin == 0;
        if (hike.k == 0) {
            hand_on(&w);
            w.first = true;
        }
        if (!taken && w.memory == NULL) {
            continue;
        }
        operator_row_but_bends(&hike.walk, hike_level(&hike), w.row + w.waiting * n);
        if (taken) {
            w.taken[w.count] = w.waiting;
            w.sample[w.count++] = hike.at;
        }
        if (++w.waiting == PINK_ROWS) {
            hand_on(&w);
        }
    }
    hand_on(&w);
    free(w.row);
    free(w.white);
    free(w.memory);
}

static void keep(void *context, double *row, const size_t *sample, size_t rows) {
    kept_rows_t *kept = context;
    memcpy(kept->row + kept->rows * kept->columns, row, rows * kept->columns * sizeof(double));
    memcpy(kept->sample + kept->rows, sample, rows * sizeof(size_t));
    kept->rows += rows;
}

void kept_rows_open(kept_rows_t *kept, const rows_wanted_t *wanted) {
    size_t used = 0;
    for (size_t i = 0, at = 0; i < wanted->count; i++) {
        for (size_t k = 0; k < wanted->paths[i].samples; k++, at++) {
            used += is_wanted(wanted, at) ? 1 : 0;
        }
    }
    const size_t most = (used + wanted->thin - 1) / wanted->thin;
    *kept = (kept_rows_t){.columns = wanted->operator->columns, .sample = allocate(most + 1, sizeof(size_t))};
    kept->row = allocate(most * kept->columns + 1, sizeof(double));
    rows_stream(wanted, keep, kept);
}

void kept_rows_close(kept_rows_t *kept) {
    free(kept->row);
    free(kept->sample);
    *kept = (kept_rows_t){0};
}

void kept_rows_whiten(const kept_rows_t *kept, const operator_path_t *paths, size_t count, const pink_t *noise,
                      const double *column, double *value, size_t stride) {
    double *memory = pink_memory(noise, 1);
    for (size_t r = 0; memory == NULL && r < kept->rows; r++) {
        value[r * stride] = column[kept->sample[r]];
    }
    for (size_t i = 0, at = 0, r = 0; memory != NULL && i < count; i++) {
        for (size_t k = 0; k < paths[i].samples; k++, at++) {
            double now = column[at];
            pink_row(noise, memory, 1, &now, k == 0);
            if (r < kept->rows && kept->sample[r] == at) {
                value[r++ * stride] = now;
            }
        }
    }
    free(memory);
}
