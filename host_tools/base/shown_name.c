/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "base/shown_name.h"
#include <ctype.h>
#include <stdio.h>
#include <string.h>

enum { MOST_NAMES = 4 };

static struct { const char *path, *shown; } names[MOST_NAMES];

void shown_name_set(const char *path, const char *shown) {
    for (size_t i = 0; i < MOST_NAMES; i++) {
        if (names[i].path == NULL || strcmp(names[i].path, path) == 0) {
            names[i].path = path;
            names[i].shown = shown;
            return;
        }
    }
}

const char *shown_name(const char *path) {
    for (size_t i = 0; i < MOST_NAMES && names[i].path != NULL; i++) {
        if (strcmp(names[i].path, path) == 0) {
            return names[i].shown;
        }
    }
    return path;
}

const char *without_folder(const char *path) {
    const char *slash = strrchr(path, '/');
    return slash == NULL ? path : slash + 1;
}

void shown_names_put_in(char *text, size_t room) {
    for (size_t i = 0; i < MOST_NAMES && names[i].path != NULL; i++) {
        const size_t length = strlen(names[i].path), shown = strlen(names[i].shown);
        char *at = text;
        while ((at = strstr(at, names[i].path)) != NULL) {
            const char *rest = at + length;
            const size_t left = room - (size_t)(at - text);
            if (isdigit((unsigned char)*rest) || strlen(rest) + shown + 1 > left) { /* /dev/fd/30 is not /dev/fd/3 */
                at++;
                continue;
            }
            memmove(at + shown, rest, strlen(rest) + 1);
            memcpy(at, names[i].shown, shown);
            at += shown;
        }
    }
}
