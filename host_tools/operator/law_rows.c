/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "operator/law_rows.h"
#include "base/parallel.h"
#include "base/progress.h"
#include <math.h>
#include <stdlib.h>

/* What one law gives: its first columns are powers of h, and h u. */
enum { POWERS = 4, H = 0, H_U, H_SQUARE, H_CUBE };

static void move_to(const law_along_t *along, const duhem_table_t *table, double drive_v, duhem_state_t *state,
                    double *u) {
    const double now = operator_level(along->operator, drive_v);
    if (now != *u) {
        duhem_move(table, state, now - *u);
        *u = now;
    }
}

/* width 1: h alone. row[i * stride]. */
static void go_along(const law_along_t *along, const duhem_table_t *table, size_t width, size_t stride, double *row) {
    const kept_rows_t *kept = along->kept;
    double *memory = pink_memory(along->noise, width), u = 0.0, now[POWERS];
    for (size_t i = 0, at = 0, r = 0; i < along->count && !progress_cancelled(); i++) {
        const operator_path_t *path = &along->paths[i];
        duhem_state_t state;
        for (size_t k = 0; k < path->samples; k++, at++) {
            if (k == 0) {
                duhem_begin(table, &state);
                u = operator_level(along->operator, path_moved_v(path, 0));
            } else if (along->turns && !isnan(path->way_v[k])) {
                move_to(along, table, path->way_v[k], &state, &u);
            }
            move_to(along, table, path_moved_v(path, k), &state, &u);
            const bool taken = r < kept->rows && kept->sample[r] == at;
            if (!taken && memory == NULL) {
                continue;
            }
            now[H] = duhem_value(table, &state);
            now[H_U] = now[H] * u;
            now[H_SQUARE] = now[H] * now[H];
            now[H_CUBE] = now[H_SQUARE] * now[H];
            pink_row(along->noise, memory, width, now, k == 0);
            for (size_t j = 0; taken && j < width; j++) {
                row[r * stride + j] = now[j];
            }
            r += taken ? 1 : 0;
        }
    }
    free(memory);
}

void law_rows_of(const law_along_t *along, const duhem_table_t *table, double *h) {
    go_along(along, table, 1, 1, h);
}

typedef struct {
    const law_along_t *along;
    double *row;
} law_task_t;

static void go_along_one(void *context, size_t index) {
    const law_task_t *task = context;
    go_along(task->along, &task->along->operator->table[index], index == 0 ? POWERS : 1, OPERATOR_LAW,
             task->row + (index == 0 ? 0 : POWERS + index - 1));
}

void law_rows(const law_along_t *along, double *row) {
    parallel(1 + DUHEM_NUMBERS, go_along_one, &(law_task_t){.along = along, .row = row});
    for (size_t r = 0; r < along->kept->rows; r++) {
        double *one = row + r * OPERATOR_LAW;
        for (size_t i = 0; i < DUHEM_NUMBERS; i++) {
            one[POWERS + i] = (one[POWERS + i] - one[H]) / operator_law_step;
        }
    }
}
