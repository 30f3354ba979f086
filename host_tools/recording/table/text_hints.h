/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Units that a text names somewhere beside its table: "# units: time=ms, drive=mV", "Channel 2: position, unit nm". */
#ifndef TEXT_HINTS_H
#define TEXT_HINTS_H

#include "recording/table/table.h"

/** Sets unit_hint of the table from lines above and below the data, [begin, end), that speak of units. */
void text_find_unit_hints(table_t *table, const char *const *line, size_t begin, size_t end, size_t lines);

#endif
