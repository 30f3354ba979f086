/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Numbers in which a sign between thousands or before decimals hides the columns of a table. */
#ifndef TEXT_SIGNS_H
#define TEXT_SIGNS_H

#include <stdbool.h>
#include <stddef.h>

/** A number with signs between thousands: "14,256.3", "14.256,3", "1'234'567", "14 256,3". */
bool text_is_grouped(const char *field, size_t length);

typedef struct {
    size_t names;   /**< fields of the line above the data, all words */
    size_t fields;  /**< of the lines of data */
    bool whole;     /**< all of them are whole numbers */
    bool thousands; /**< one has up to three digits in all lines, and the next begins with three more */
} text_signs_t;

/** What has happened where a line has more fields than there are names; NULL: nothing that is known. */
const char *text_signs_problem(const text_signs_t *signs);

#endif
