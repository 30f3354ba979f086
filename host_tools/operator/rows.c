/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "operator/rows.h"
#include "base/failure.h"
#include <stdlib.h>
#include <string.h>

/* What the rows of one walk pass through to be whitened for one noise, and who takes them. */
typedef struct {
    state_space_rows_t filter;
    double offset; /* of a constant behind the filter, whitened */
    void *context;
} lane_t;

/* Rows of one recording that wait: all of them where a filter remembers, otherwise those that are wanted. */
typedef struct {
    const rows_wanted_t *wanted;
    rows_taker_t *take;
    lane_t lane[ROWS_MOST_NOISES];
    size_t lanes;
    size_t columns, ahead, waiting, count; /* count: of these, wanted */
    size_t recording;                      /* of the rows that wait */
    bool first, remembers;                 /* first: they begin a recording */
    double *row, *filtered, *last;         /* last: row of this recording */
    size_t taken[STATE_SPACE_ROWS], sample[STATE_SPACE_ROWS];
    struct {
        bool taken;
        size_t sample;
    } due[STATE_SPACE_AHEAD]; /* what comes out next, oldest first */
    size_t dues;
} waiting_t;

static void hand_on_filtered(waiting_t *w, lane_t *lane) {
    state_space_rows(&lane->filter, w->row, w->waiting, w->first, w->taken, w->count, w->filtered);
    for (size_t i = 0; w->wanted->offsets_behind && i < w->count; i++) {
        w->filtered[i * w->columns + operator_offset_column(w->recording)] = lane->offset;
    }
    if (w->count > 0) {
        w->take(lane->context, w->filtered, w->sample, w->count);
    }
}

static void hand_on(waiting_t *w) {
    if (w->waiting == 0) {
        return;
    }
    operator_bends(w->wanted->operator, w->row, w->waiting);
    if (w->remembers) {
        for (size_t i = 0; i < w->lanes; i++) {
            hand_on_filtered(w, &w->lane[i]);
        }
    } else {
        w->take(w->lane[0].context, w->row, w->sample, w->count);
    }
    w->waiting = w->count = 0;
    w->first = false;
}

/* The row at w->row + w->waiting * w->columns is there; what comes out with it belongs to the sample `ahead` before. */
static void row_is_there(waiting_t *w, bool taken, size_t sample) {
    bool taken_now = taken;
    size_t sample_now = sample;
    if (w->ahead > 0) {
        const bool full = w->dues == w->ahead;
        taken_now = full && w->due[0].taken;
        sample_now = w->due[0].sample;
        if (full) {
            memmove(&w->due[0], &w->due[1], (w->ahead - 1) * sizeof w->due[0]);
        } else {
            w->dues++;
        }
        w->due[w->dues - 1].taken = taken;
        w->due[w->dues - 1].sample = sample;
    }
    if (taken_now) {
        w->taken[w->count] = w->waiting;
        w->sample[w->count++] = sample_now;
    }
    if (++w->waiting == STATE_SPACE_ROWS) {
        hand_on(w);
    }
}

/* Where the filter looks ahead, beyond the end of a recording: its last row again. */
static void end_recording(waiting_t *w) {
    for (size_t i = 0; i < w->ahead && w->dues > 0; i++) {
        memcpy(w->row + w->waiting * w->columns, w->last, w->columns * sizeof(double));
        row_is_there(w, false, 0);
    }
    hand_on(w);
    w->dues = 0;
    w->first = true;
}

static inline bool is_wanted(const rows_wanted_t *wanted, size_t at) {
    return (wanted->use[at] == 0) == wanted->unused;
}

/* The columns pass through what is behind the operator, and are whitened. All lanes look equally far ahead. */
static void open_lane(waiting_t *w, const pink_t *noise, void *context) {
    const state_space_t whitening = pink_states(noise);
    state_space_t *all = allocate(1, sizeof *all);
    lane_t *lane = &w->lane[w->lanes++];
    (void)state_space_cascade(w->wanted->behind, &whitening, all); /* it has room for the noise: BEHIND_STATES */
    state_space_rows_open(&lane->filter, all, w->columns);
    lane->offset = state_space_gain_at_rest(&whitening);
    lane->context = context;
    w->ahead = all->ahead;
    w->remembers = w->remembers || w->lanes > 1 || !state_space_is_identity(all);
    free(all);
}

/* For several noises at once: context[i] takes the rows that noise[i] has whitened. */
static void stream(const rows_wanted_t *wanted, const pink_t *const *noise, size_t noises, rows_taker_t *take,
                   void *const *context) {
    const size_t n = wanted->operator->columns;
    waiting_t w = {.wanted = wanted,
                   .take = take,
                   .columns = n,
                   .row = allocate(STATE_SPACE_ROWS * n, sizeof(double)),
                   .filtered = allocate(STATE_SPACE_ROWS * n, sizeof(double)),
                   .last = allocate(n, sizeof(double))};
    size_t used = 0;
    for (size_t i = 0; i < noises; i++) {
        open_lane(&w, noise[i], context[i]);
    }
    for (hike_t hike = hike_begin(wanted->paths, wanted->count, wanted->turns); hike_on(&hike, wanted->operator);) {
        const bool taken = is_wanted(wanted, hike.at) && used++ % wanted->thin == 0;
        if (hike.k == 0) {
            end_recording(&w);
            w.recording = hike.walk.recording;
        }
        if (!taken && !w.remembers) {
            continue;
        }
        double *row = w.row + w.waiting * n;
        operator_row_but_bends(&hike.walk, hike_level(&hike), row);
        if (w.ahead > 0) {
            memcpy(w.last, row, n * sizeof(double));
        }
        row_is_there(&w, taken, hike.at);
    }
    end_recording(&w);
    for (size_t i = 0; i < w.lanes; i++) {
        state_space_rows_close(&w.lane[i].filter);
    }
    free(w.row);
    free(w.filtered);
    free(w.last);
}

void rows_stream(const rows_wanted_t *wanted, rows_taker_t *take, void *context) {
    stream(wanted, &wanted->noise, 1, take, &context);
}

static void keep(void *context, double *row, const size_t *sample, size_t rows) {
    kept_rows_t *kept = context;
    memcpy(kept->row + kept->rows * kept->columns, row, rows * kept->columns * sizeof(double));
    memcpy(kept->sample + kept->rows, sample, rows * sizeof(size_t));
    kept->rows += rows;
}

void kept_rows_open_each(kept_rows_t *const *kept, const rows_wanted_t *wanted, const pink_t *const *noise,
                         size_t noises) {
    void *context[ROWS_MOST_NOISES];
    size_t used = 0;
    for (size_t i = 0, at = 0; i < wanted->count; i++) {
        for (size_t k = 0; k < wanted->paths[i].samples; k++, at++) {
            used += is_wanted(wanted, at) ? 1 : 0;
        }
    }
    const size_t most = (used + wanted->thin - 1) / wanted->thin;
    for (size_t i = 0; i < noises; i++) {
        *kept[i] = (kept_rows_t){.columns = wanted->operator->columns, .sample = allocate(most + 1, sizeof(size_t))};
        kept[i]->row = allocate(most * kept[i]->columns + 1, sizeof(double));
        context[i] = kept[i];
    }
    stream(wanted, noise, noises, keep, context);
}

void kept_rows_open(kept_rows_t *kept, const rows_wanted_t *wanted) {
    kept_rows_open_each(&kept, wanted, &wanted->noise, 1);
}

void kept_rows_close(kept_rows_t *kept) {
    free(kept->row);
    free(kept->sample);
    *kept = (kept_rows_t){0};
}

void kept_rows_whiten(const kept_rows_t *kept, const operator_path_t *paths, size_t count, const pink_t *noise,
                      const double *column, double *value, size_t stride) {
    double *memory = pink_memory(noise);
    for (size_t r = 0; memory == NULL && r < kept->rows; r++) {
        value[r * stride] = column[kept->sample[r]];
    }
    for (size_t i = 0, at = 0, r = 0; memory != NULL && i < count; i++) {
        for (size_t k = 0; k < paths[i].samples; k++, at++) {
            double now = column[at];
            pink_value(noise, memory, &now, k == 0);
            if (r < kept->rows && kept->sample[r] == at) {
                value[r++ * stride] = now;
            }
        }
    }
    free(memory);
}
