/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Numbers in which a sign between thousands or before decimals hides the columns of a table. */
#ifndef TEXT_SIGNS_H
#define TEXT_SIGNS_H

#include <stdbool.h>
#include <stddef.h>

/** A number with signs between thousands: "14,256.3", "14.256,3", "1'234'567", "14 256,3". */
bool text_is_grouped(const char *field, size_t length);

/** How a column of numbers is written: with a sign before three digits, whole with up to three digits, in other ways.
 */
typedef struct {
    size_t grouped, shorter, others;
} text_groups_t;

/** Counts a number; returns whether a sign stands before three digits, "1,080". */
bool text_groups_count(text_groups_t *groups, const char *field, size_t length);

/** Whether these signs may stand between thousands though they look like that of decimals, which would have other
 * numbers of digits as well. */
bool text_groups_are_even(const text_groups_t *groups);

/** Whether they do: whole numbers of fewer digits stand beside them, "987", "1,080". */
bool text_groups_are_thousands(const text_groups_t *groups);

typedef struct {
    size_t names;   /**< fields of the line above the data, all words */
    size_t fields;  /**< of the lines of data */
    bool whole;     /**< all of them are whole numbers */
    bool thousands; /**< one has up to three digits in all lines, and the next begins with three more */
} text_signs_t;

/** What has happened where a line has more fields than there are names; NULL: nothing that is known. */
const char *text_signs_problem(const text_signs_t *signs);

#endif
