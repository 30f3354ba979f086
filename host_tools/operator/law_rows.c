/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "operator/law_rows.h"
#include "base/parallel.h"
#include "base/progress.h"
#include <math.h>
#include <stdlib.h>

static void move_to(const law_along_t *along, const duhem_table_t *table, double drive_v, duhem_state_t *state,
                    double *u) {
    const double now = operator_level(along->operator, drive_v);
    if (now != *u) {
        duhem_move(table, state, now - *u);
        *u = now;
    }
}

/* The law along one path: h at each sample. */
static void go_along_path(const law_along_t *along, const duhem_table_t *table, const operator_path_t *path, double *h,
                          double *u) {
    duhem_state_t state;
    duhem_begin(table, &state);
    double now = operator_level(along->operator, path_moved_v(path, 0));
    for (size_t k = 0; k < path->samples; k++) {
        if (k > 0 && along->turns && !isnan(path->way_v[k])) {
            move_to(along, table, path->way_v[k], &state, &now);
        }
        move_to(along, table, path_moved_v(path, k), &state, &now);
        h[k] = duhem_value(table, &state);
        u[k] = now;
    }
}

/* A column of the law, made of h and u. */
static void make_column(size_t column, const double *h, const double *u, size_t samples, double *value) {
    for (size_t k = 0; k < samples; k++) {
        value[k] = column == LAW_H        ? h[k]
                   : column == LAW_H_U    ? h[k] * u[k]
                   : column == LAW_H_CUBE ? h[k] * h[k] * h[k]
                                          : h[k] * h[k];
    }
}

/* width 1: h alone. row[i * stride]. */
static void go_along(const law_along_t *along, const duhem_table_t *table, size_t width, size_t stride, double *row) {
    const kept_rows_t *kept = along->kept;
    size_t longest = 0, r = 0;
    for (size_t i = 0; i < along->count; i++) {
        longest = along->paths[i].samples > longest ? along->paths[i].samples : longest;
    }
    double *h = allocate(longest, sizeof(double)), *u = allocate(longest, sizeof(double)),
           *value = allocate(longest, sizeof(double)), *memory = pink_memory(along->noise);
    for (size_t i = 0, at = 0; i < along->count && !progress_cancelled(); at += along->paths[i++].samples) {
        const size_t samples = along->paths[i].samples, begin = r;
        go_along_path(along, table, &along->paths[i], h, u);
        for (size_t j = 0; j < width; j++) {
            make_column(j, h, u, samples, value);
            state_space_column(along->behind, value, samples);
            r = begin;
            for (size_t k = 0; k < samples; k++) {
                pink_value(along->noise, memory, &value[k], k == 0);
                if (r < kept->rows && kept->sample[r] == at + k) {
                    row[r++ * stride + j] = value[k];
                }
            }
        }
    }
    free(h);
    free(u);
    free(value);
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
    go_along(task->along, &task->along->operator->table[index], index == 0 ? OPERATOR_LAW_CURVES : 1, OPERATOR_LAW,
             task->row + (index == 0 ? 0 : OPERATOR_LAW_CURVES + index - 1));
}

void law_rows(const law_along_t *along, double *row) {
    parallel(1 + DUHEM_NUMBERS, go_along_one, &(law_task_t){.along = along, .row = row});
    for (size_t r = 0; r < along->kept->rows; r++) {
        double *one = row + r * OPERATOR_LAW;
        for (size_t i = 0; i < DUHEM_NUMBERS; i++) {
            one[OPERATOR_LAW_CURVES + i] = (one[OPERATOR_LAW_CURVES + i] - one[LAW_H]) / operator_law_step;
        }
    }
}
