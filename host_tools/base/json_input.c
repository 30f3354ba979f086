/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "base/json_input.h"
#include <errno.h>
#include <stdio.h>
#include <string.h>

/* Whether a document may begin so. Leaves the stream where it was. */
static bool begins(FILE *file, const char *path, const char *what, failure_t *failure) {
    errno = 0;
    const int first = getc(file);
    if (first == EOF) {
        return fail(failure, "%s: %s", path, errno != 0 ? strerror(errno) : "empty");
    }
    (void)ungetc(first, file);
    return strchr("{[ \t\r\n", first) != NULL || fail(failure, "%s: not %s, which is JSON", path, what);
}

json_t *json_read(const char *path, const char *what, failure_t *failure) {
    json_error_t error;
    json_t *json = NULL;
    FILE *file = fopen(path, "rb");
    if (file == NULL) {
        fail(failure, "%s: %s", path, strerror(errno));
        return NULL;
    }
    if (begins(file, path, what, failure)) {
        json = json_loadf(file, JSON_REJECT_DUPLICATES, &error);
        if (json == NULL) {
            fail(failure, "%s:%d: %s", path, error.line, error.text);
        }
    }
    (void)fclose(file);
    return json;
}
