/* SPDX-License-Identifier: GPL-3.0-or-later */
/** A self-contained HTML page (no script, no network; light, dark and paper) with room for pictures of svg_plot.h. On
 * paper what is of class with-next stays on the page of what follows. */
#ifndef HTML_PAGE_H
#define HTML_PAGE_H

#include "failure.h"
#include <stdbool.h>
#include <stdio.h>

/** Opens the file and writes everything up to the contents. NULL after a complaint. */
FILE *page_open(const char *path, const char *title, failure_t *failure);

/** Ends the page. Unless `good`, removes the file and returns false; *failure then is the caller's. */
bool page_close(FILE *file, const char *path, bool good, failure_t *failure);

/** Closes a file; complains if anything could not be written. */
bool file_close_written(FILE *file, const char *path, failure_t *failure);

#endif
