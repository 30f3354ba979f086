/* SPDX-License-Identifier: GPL-3.0-or-later */
/** A self-contained HTML page (no network; light, dark and paper) with room for pictures of svg_plot.h. Its one script
 * reads out and enlarges them; all that the page says stands there without it. In print, an element of class with-next
 * stays on the page of the next one, and <details> are open. */
#ifndef HTML_PAGE_H
#define HTML_PAGE_H

#include "base/output_file.h"

/** Opens the file and writes everything up to the contents, which the caller writes to page->file. The first heading is
 * the title that the run was given (base/provenance.h), with this one below; else this one. */
bool page_open(output_file_t *page, const char *path, const char *title, failure_t *failure);

/** Ends the page, with where it comes from (base/provenance.h), as output_file_close does. */
bool page_close(output_file_t *page, bool good, failure_t *failure);

#endif
