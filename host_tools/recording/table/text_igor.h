/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Igor text waves (.itx): their scales and units stand behind the numbers. */
#ifndef TEXT_IGOR_H
#define TEXT_IGOR_H

#include "recording/table/table.h"
#include "recording/table/text_source.h"

bool text_is_igor(const text_source_t *source);

/** Waves that stand in blocks one below the other become one block, side by side. False: they differ in length. */
bool text_join_igor_waves(text_source_t *source, const char *path, failure_t *failure);

/** From lines such as `X SetScale/P x 0,0.001,"s", drive; SetScale y 0,0,"V", drive`: interval and start of the table,
 * and units of the columns that have none. */
void text_find_igor_scales(table_t *table, const char *const *line, size_t from, size_t lines);

#endif
