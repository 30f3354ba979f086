/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "recording/import_account.h"
#include "base/failure.h"
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void import_account_add(import_account_t *account, const char *format, ...) {
    char text[800];
    va_list arguments;
    if (account == NULL) {
        return;
    }
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    account->line = reallocate(account->line, account->lines + 1, sizeof *account->line);
    account->line[account->lines++] = copy_text(text);
}

char *import_account_text(const import_account_t *account) {
    size_t length = 0;
    char *text, *at;
    for (size_t i = 0; i < account->lines; i++) {
        length += strlen(account->line[i]) + 1;
    }
    text = at = allocate(length + 1, 1);
    for (size_t i = 0; i < account->lines; i++) {
        const size_t size = strlen(account->line[i]);
        memcpy(at, account->line[i], size);
        at[size] = '\n';
        at += size + 1;
    }
    *at = '\0';
    return text;
}

void import_account_free(import_account_t *account) {
    for (size_t i = 0; i < account->lines; i++) {
        free(account->line[i]);
    }
    free(account->line);
    memset(account, 0, sizeof *account);
}
