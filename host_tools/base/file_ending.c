/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "base/file_ending.h"
#include <stddef.h>
#include <string.h>
#include <strings.h>

const char *file_ending(const char *name, const char *const endings[]) {
    const size_t length = strlen(name);
    for (size_t i = 0; endings[i] != NULL; i++) {
        const size_t size = strlen(endings[i]);
        if (length > size && strcasecmp(name + length - size, endings[i]) == 0) {
            return endings[i];
        }
    }
    return NULL;
}
