/* SPDX-License-Identifier: GPL-3.0-or-later */
/** A text file as lines of UTF-8, whatever it was written as. */
#ifndef TEXT_SOURCE_H
#define TEXT_SOURCE_H

#include "base/failure.h"
#include <stddef.h>

typedef struct {
    char *text; /**< the whole file, every line ended by '\0'; lines hold no other control characters than tab */
    size_t lines;
    char **line;
    const char *encoding; /**< "UTF-8", "UTF-16", "Latin-1", "Windows-1251", .. */
    bool compressed;
    char *joined;  /**< lines that were put together of others, or NULL */
    char blank[1]; /**< an empty line, for those that are no more */
} text_source_t;

/**
 * Reads a file, gzip or plain: byte order mark, UTF-16 of either order (with or without mark), LF, CR LF or CR at line
 * ends. Bytes that are no UTF-8 are in the encoding of the region in which most words and units are known, else
 * Latin-1. Refuses what has control characters in it: binary data, with the
 * line.
 */
bool text_source_read(text_source_t *source, const char *path, failure_t *failure);
void text_source_free(text_source_t *source);

#endif
