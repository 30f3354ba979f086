/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Names and units of the columns of a text: from the lines above the data, and from what stands around the numbers. */
#ifndef TEXT_NAMES_H
#define TEXT_NAMES_H

#include "recording/table/table.h"
#include "recording/table/text_fields.h"
#include "recording/table/text_source.h"

typedef struct {
    dialect_t dialect;
    bool number[MOST_COLUMNS];          /**< the columns that hold the data */
    bool word[MOST_COLUMNS];            /**< those that hold words */
    bool partial[MOST_COLUMNS];         /**< those that hold numbers in a part of the lines, and else nothing */
    around_text_t around[MOST_COLUMNS]; /**< what stands around the numbers of each column */
    size_t columns;                     /**< how many of them are numbers */
    size_t fields;                      /**< of the first line of data */
    bool labels;                        /**< lines of data begin with a word */
    size_t begin, end;                  /**< lines of data: [begin, end) */
} layout_t;

/** Whether a remark has words over the columns of numbers that name them: two at least are known words or units. */
bool text_has_names(const layout_t *layout, const char *line);

/** Adds the columns of numbers to the table, with their values (taken over). Notes those of words. */
void text_name_columns(table_t *table, const text_source_t *source, const layout_t *layout, double **value);

#endif
