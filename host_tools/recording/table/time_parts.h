/* SPDX-License-Identifier: GPL-3.0-or-later */
/** A time in two columns: whole seconds, and the thousandths or billionths behind them. */
#ifndef TIME_PARTS_H
#define TIME_PARTS_H

#include "recording/table/table.h"

/** Where no column of times rises all the time, but one of whole seconds does together with one of their parts ("ms",
 * "nsecs"), the former becomes the sum of both, and is called so. */
void time_parts_join(table_t *table);

#endif
