/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "recording/column_pattern.h"
#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

bool column_pattern_matches(const char *pattern, const char *name, const char **part, size_t *length) {
    const size_t before = strcspn(pattern, "*");
    const char *after = pattern + before + 1;
    if (strlen(name) <= before + strlen(after)) {
        return false;
    }
    *part = name + before;
    *length = strlen(name) - before - strlen(after);
    return strncasecmp(name, pattern, before) == 0 && strcasecmp(*part + *length, after) == 0;
}

char *column_pattern_put_in(const char *pattern, const char *which) {
    const char *star = strchr(pattern, '*');
    const size_t room = strlen(pattern) + strlen(which) + 1;
    char *name = allocate(room, 1);
    (void)snprintf(name, room, "%.*s%s%s", (int)(star - pattern), pattern, which, star + 1);
    return name;
}

/* '*' in place of the last number of a name, or of its group. */
static bool generalise(const char *name, bool group, char pattern[COLUMN_PATTERN]) {
    size_t from = 0, to = 0;
    if (group) {
        const char *slash = strrchr(name, '/');
        to = slash != NULL ? (size_t)(slash - name) : 0;
    } else {
        for (to = strlen(name); to > 0 && !isdigit((unsigned char)name[to - 1]); to--) {
        }
        for (from = to; from > 0 && isdigit((unsigned char)name[from - 1]); from--) {
        }
    }
    return to > from && snprintf(pattern, COLUMN_PATTERN, "%.*s*%s", (int)from, name, name + to) < COLUMN_PATTERN;
}

static bool has_column(const table_t *table, const char *name) {
    for (size_t i = 0; i < table->columns; i++) {
        if (strcasecmp(table->column[i].name, name) == 0) {
            return true;
        }
    }
    return false;
}

size_t column_pattern_siblings(const table_t *table, const char *drive, const char *displacement,
                               char pattern[2][COLUMN_PATTERN]) {
    for (int group = 0; group < 2; group++) {
        size_t pairs = 0;
        if (!generalise(drive, group != 0, pattern[0]) || !generalise(displacement, group != 0, pattern[1])) {
            continue;
        }
        if (strcasecmp(pattern[0], pattern[1]) == 0) { /* CH1 and CH2 are one actuator's */
            continue;
        }
        for (size_t i = 0; i < table->columns; i++) {
            const char *part;
            size_t length;
            if (!column_pattern_matches(pattern[0], table->column[i].name, &part, &length) ||
                (group == 0 && strspn(part, "0123456789") < length)) {
                continue;
            }
            char which[COLUMN_PATTERN];
            (void)snprintf(which, sizeof which, "%.*s", (int)length, part);
            char *other = column_pattern_put_in(pattern[1], which);
            pairs += has_column(table, other) ? 1 : 0;
            free(other);
        }
        if (pairs > 1) {
            return pairs;
        }
    }
    return 0;
}
