/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Which column of a table is what: by the caller's options, then by what names and units say (column_meaning.h), then
 * by place.
 *
 * By place, drive before displacement, are taken columns of which neither name nor unit says a quantity, or that are
 * some voltage; only where there are just as many of them as are missing. A column that counts, that never changes or
 * that repeats the times is none of them. Where more than one column could be drive or displacement, that is a problem
 * that lists the columns and names the options. Several actuators, numbered alike (column_pattern.h), are no such case:
 * the first is taken. Reference, voltage, current and temperature are left out where their column is not clear.
 */
#ifndef COLUMN_CHOICE_H
#define COLUMN_CHOICE_H

#include "recording/column_meaning.h"
#include "recording/import_account.h"
#include "recording/import_options.h"

enum { NO_COLUMN = -1, ROLE_TIME = COLUMN_COUNT, ROLES };

typedef struct {
    int column[ROLES];         /**< of the table, from 0, or NO_COLUMN; the last one is time */
    const char *why[ROLES];    /**< how it was found: "by its name" */
    column_meaning_t *meaning; /**< of each column of the table */
} column_choice_t;

/** Adds a line to `problems` for each column that is missing or not clear. To be freed. */
void columns_choose(column_choice_t *choice, const table_t *table, const import_options_t *options,
                    import_account_t *problems);
void column_choice_free(column_choice_t *choice);

/** "time", or the name of a column of a recording. */
const char *role_name(int role);

/** Whether a column of the table was taken for one of a recording, or for the times. */
bool column_is_used(const column_choice_t *choice, int column);

/** The columns that are not used, and what they are: "column 1 'Index' (counter), ..". Empty: all are used. */
void columns_not_used(const column_choice_t *choice, const table_t *table, char *text, size_t room);

#endif
