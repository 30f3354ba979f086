/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Names of columns with a '*', which stands for what tells several of a kind apart: "V*" for V1, V2 .. */
#ifndef COLUMN_PATTERN_H
#define COLUMN_PATTERN_H

#include "recording/table/table.h"

/** Length of a pattern in bytes, with its end. */
enum { COLUMN_PATTERN = 100 };

/** Whether a name is of this pattern, in any case; *part, of `length` characters, at least one: what '*' stands for. */
bool column_pattern_matches(const char *pattern, const char *name, const char **part, size_t *length);
/** The name with that in place of '*'. To be freed. */
char *column_pattern_put_in(const char *pattern, const char *which);

/** Where columns of this drive and displacement are not the only ones of their kind: the names with a '*' for the
 * number, or the group, in which others differ, and the number of pairs. 0: there are no others. */
size_t column_pattern_siblings(const table_t *table, const char *drive, const char *displacement,
                               char pattern[2][COLUMN_PATTERN]);

#endif
