/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Igor text waves (.itx): their scales and units stand behind the numbers. */
#ifndef TEXT_IGOR_H
#define TEXT_IGOR_H

#include "recording/table/table.h"

/** From lines such as `X SetScale/P x 0,0.001,"s", drive; SetScale y 0,0,"V", drive`: interval and start of the table,
 * and units of the columns that have none. */
void text_find_igor_scales(table_t *table, const char *const *line, size_t from, size_t lines);

#endif
