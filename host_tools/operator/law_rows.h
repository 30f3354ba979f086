/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Whitened columns of Duhem laws along paths, without the rest of the operator. */
#ifndef OPERATOR_LAW_ROWS_H
#define OPERATOR_LAW_ROWS_H

#include "operator/rows.h"

typedef struct {
    const operator_t *operator; /**< how the drive is measured */
    const operator_path_t *paths;
    size_t count;
    bool turns;
    const state_space_t *behind; /**< of rows_wanted_t */
    const pink_t *noise;
    const kept_rows_t *kept; /**< where: the samples of these rows */
} law_along_t;

/** One law's h at these rows. */
void law_rows_of(const law_along_t *along, const duhem_table_t *table, double *h);

/** The columns of the operator's law: row[i * OPERATOR_LAW + j]. Runs on all processors. */
void law_rows(const law_along_t *along, double *row);

#endif
