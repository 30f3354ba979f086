/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Lines of an import: what was understood, or what is wrong. */
#ifndef IMPORT_ACCOUNT_H
#define IMPORT_ACCOUNT_H

#include <stddef.h>

/** The interpretation, one line per fact; free with import_account_free. */
typedef struct {
    size_t lines;
    char **line;
} import_account_t;

#if defined(__GNUC__)
__attribute__((format(printf, 2, 3)))
#endif
/** Adds a line; account may be NULL. */
void import_account_add(import_account_t *account, const char *format, ...);

/** All lines as one text; to be freed. */
char *import_account_text(const import_account_t *account);

void import_account_free(import_account_t *account);

#endif
