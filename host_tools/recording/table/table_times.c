/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A time in two columns: whole seconds, and the thousandths or billionths behind them. */
#include "recording/table/column_words.h"
#include "recording/table/table.h"
#include "recording/table/units.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Seconds of one of the column's numbers; 0: it holds no times. */
static double seconds_of(const table_column_t *column) {
    double scale;
    const quantity_t quantity = unit_of(column->unit, &scale);
    const unsigned words = column_words_read(column->name, column->name + strlen(column->name)).stands_for;
    if (quantity == QUANTITY_TIME) {
        return scale;
    }
    return column->clock || (column->unit[0] == '\0' && (words & ~(unsigned)WORD_NOTHING) == (WORD_TIME | WORD_FIRST))
               ? 1.0
               : 0.0;
}

static bool rises(const table_t *table, size_t a, double of_a, size_t b, double of_b) {
    const double *const first = table->column[a].value, *const second = table->column[b].value;
    for (size_t k = 1; k < table->rows; k++) {
        if (!(of_a * (first[k] - first[k - 1]) + of_b * (second[k] - second[k - 1]) > 0.0)) {
            return false;
        }
    }
    return true;
}

/* Whole seconds that never go back. */
static bool are_whole_seconds(const table_t *table, size_t i, double scale) {
    const double *const value = table->column[i].value;
    for (size_t k = 0; k < table->rows; k++) {
        if (value[k] * scale != floor(value[k] * scale) || (k > 0 && value[k] < value[k - 1])) {
            return false;
        }
    }
    return true;
}

/* Parts of a second: never negative, never a whole one. */
static bool are_parts(const table_t *table, size_t i, double scale) {
    const double *const value = table->column[i].value;
    for (size_t k = 0; k < table->rows; k++) {
        if (!(value[k] >= 0.0 && value[k] * scale < 1.0)) {
            return false;
        }
    }
    return scale < 1.0;
}

static void join(table_t *table, size_t whole, double of_whole, size_t part, double of_part) {
    table_column_t *const column = &table->column[whole];
    const table_column_t *const other = &table->column[part];
    char name[2 * UNIT_FIELD];
    (void)snprintf(name, sizeof name, "%.100s + %.100s", column->name, other->name);
    for (size_t k = 0; k < table->rows; k++) {
        column->value[k] += other->value[k] * of_part / of_whole;
    }
    free(column->name);
    column->name = copy_text(name);
}

void table_join_times(table_t *table) {
    for (size_t i = 0; i < table->columns; i++) {
        const double scale = seconds_of(&table->column[i]);
        if (scale > 0.0 && rises(table, i, scale, i, 0.0)) {
            return;
        }
    }
    for (size_t i = 0; i < table->columns; i++) {
        const double whole = seconds_of(&table->column[i]);
        for (size_t j = 0; whole > 0.0 && are_whole_seconds(table, i, whole) && j < table->columns; j++) {
            const double part = j != i ? seconds_of(&table->column[j]) : 0.0;
            if (part > 0.0 && are_parts(table, j, part) && rises(table, i, whole, j, part)) {
                join(table, i, whole, j, part);
                return;
            }
        }
    }
}
