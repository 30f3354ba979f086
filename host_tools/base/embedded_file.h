/* SPDX-License-Identifier: GPL-3.0-or-later */
/** A file of the source tree that the program carries (cmake/Embed.cmake). */
#ifndef EMBEDDED_FILE_H
#define EMBEDDED_FILE_H

#include <stddef.h>

typedef struct {
    const char *name, *type; /**< without its folder; media type */
    const unsigned char *data;
    size_t length;
} embedded_file_t;

#endif
